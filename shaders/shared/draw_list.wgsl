// The head of the emitted list: the draw's arguments, then what was counted. All zero before `emit`.
// Twin: core/reference/shared.rs

const INDEX_COUNT_WORD: u32 = 0u;       // arguments of an indexed indirect draw: 5 words
const INSTANCE_COUNT_WORD: u32 = 1u;
const SHIFT_COUNTS_WORD: u32 = 5u;      // 3 words: indices at shift 0, 1, 2
const CURSOR_WORD: u32 = 8u;            // indices reserved so far
const CLASS_COUNTS_WORD: u32 = 9u;      // 6 words: patches by depth, regular ones first, then transition ones
const DRAW_LIST_WORDS: u32 = 16u;
