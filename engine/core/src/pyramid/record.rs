//! A tile's record: the bytes of one inner chunk, of one fixed layout a level.
//!
//! `FORMAT.md` draws it. Knows bytes and numbers; knows no file and no neighbour.

use super::{Level, Summary};
use crate::geo::{CAGE_CONTROL_COUNT, PATCH_COUNT, TILE_SAMPLE_COUNT, TileId};

/// Bytes of a tile's id at the start of its record.
const ID_BYTES: usize = 12;
/// Bytes of one summary.
const SUMMARY_BYTES: usize = 16;
/// Bytes of a tile's void bits.
pub const VOID_BYTES: usize = TILE_SAMPLE_COUNT.div_ceil(8);

/// What a record holds, to be written.
#[derive(Clone, Copy, Debug)]
pub struct RecordParts<'a> {
    /// Whose record it is: a chunk that lands in the wrong place is noticed.
    pub id: TileId,
    /// What the tile says of itself.
    pub summary: Summary,
    /// What it says of its children, by quadrant.
    pub children: [Summary; 4],
    /// 32 × 32 patch error codes.
    pub patch_codes: &'a [u8],
    /// 129 × 129 void bits; ignored where the level stores none, none void where it does and they are missing.
    pub voids: Option<&'a [u8]>,
    /// 35 × 35 stored cage numbers: codes against neighbours at a key level, else against the parent.
    pub cage: &'a [i32],
    /// 129 × 129 residual codes.
    pub detail: &'a [i32],
}

/// What a record holds, as read.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Whose record it is.
    pub id: TileId,
    /// What the tile says of itself.
    pub summary: Summary,
    /// What it says of its children, by quadrant.
    pub children: [Summary; 4],
    /// 32 × 32 patch error codes.
    pub patch_codes: Box<[u8]>,
    /// 129 × 129 void bits, where the level stores them.
    pub voids: Option<Box<[u8]>>,
    /// 35 × 35 stored cage numbers: codes against neighbours at a key level, else against the parent.
    pub cage: Box<[i32]>,
    /// 129 × 129 residual codes.
    pub detail: Box<[i32]>,
}

/// Where a level's records have what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordLayout {
    voids: bool,
    cage_bytes: u8,
    detail_bytes: u8,
}

impl RecordLayout {
    /// The layout of a level's records.
    #[must_use]
    pub const fn new(level: &Level) -> Self {
        Self {
            voids: level.voids,
            cage_bytes: level.cage_bytes,
            detail_bytes: level.detail_bytes,
        }
    }

    /// Bytes of every record.
    #[must_use]
    pub const fn byte_count(&self) -> usize {
        ID_BYTES
            + 5 * SUMMARY_BYTES
            + PATCH_COUNT
            + if self.voids { VOID_BYTES } else { 0 }
            + CAGE_CONTROL_COUNT * self.cage_bytes as usize
            + TILE_SAMPLE_COUNT * self.detail_bytes as usize
    }

    /// Lengths of what follows each other in a record and is of one kind: for whoever compresses it.
    pub(super) fn sections(&self) -> Vec<usize> {
        let head = [
            ID_BYTES + 5 * SUMMARY_BYTES + PATCH_COUNT,
            if self.voids { VOID_BYTES } else { 0 },
        ];
        let planes = |count: usize, width: u8| std::iter::repeat_n(count, usize::from(width));
        let cage = planes(CAGE_CONTROL_COUNT, self.cage_bytes);
        head.into_iter()
            .chain(cage)
            .chain(planes(TILE_SAMPLE_COUNT, self.detail_bytes))
            .collect()
    }

    /// The bytes of a record.
    ///
    /// # Panics
    ///
    /// Where a part has not its length, or a number does not fit the level's width: the level's widths are chosen from
    /// all its numbers, so that would be the builder's mistake.
    #[must_use]
    pub fn encode(&self, parts: &RecordParts<'_>) -> Vec<u8> {
        assert_eq!(
            parts.patch_codes.len(),
            PATCH_COUNT,
            "patch codes of {}",
            parts.id
        );
        assert_eq!(parts.cage.len(), CAGE_CONTROL_COUNT, "cage of {}", parts.id);
        assert_eq!(
            parts.detail.len(),
            TILE_SAMPLE_COUNT,
            "codes of {}",
            parts.id
        );
        let mut bytes = Vec::with_capacity(self.byte_count());
        for word in [u32::from(parts.id.level), parts.id.row, parts.id.column] {
            bytes.extend(word.to_le_bytes());
        }
        put_summary(&mut bytes, &parts.summary);
        for child in &parts.children {
            put_summary(&mut bytes, child);
        }
        bytes.extend(parts.patch_codes);
        if self.voids {
            let voids = parts.voids.unwrap_or(&[0; VOID_BYTES]);
            assert_eq!(voids.len(), VOID_BYTES, "void bits of {}", parts.id);
            bytes.extend(voids);
        }
        put_numbers(&mut bytes, parts.cage, self.cage_bytes);
        put_numbers(&mut bytes, parts.detail, self.detail_bytes);
        bytes
    }

    /// The parts of a record.
    ///
    /// # Errors
    ///
    /// Where the length is wrong or what is always true of a record is not: what, in words.
    pub fn decode(&self, bytes: &[u8]) -> Result<Record, String> {
        if bytes.len() != self.byte_count() {
            return Err(format!(
                "the record has {} bytes, not {}",
                bytes.len(),
                self.byte_count()
            ));
        }
        let mut rest = bytes;
        let [level, row, column] = [(); 3].map(|()| u32::from_le_bytes(take(&mut rest)));
        let level = u8::try_from(level).map_err(|_| format!("the record says level {level}"))?;
        let summary = take_summary(&mut rest);
        let children = [(); 4].map(|()| take_summary(&mut rest));
        check_summary(&summary, "the tile")?;
        children
            .iter()
            .try_for_each(|child| check_summary(child, "a child"))?;
        let (patch_codes, rest) = rest.split_at(PATCH_COUNT);
        let (voids, rest) = rest.split_at(if self.voids { VOID_BYTES } else { 0 });
        let (cage, detail) = rest.split_at(CAGE_CONTROL_COUNT * usize::from(self.cage_bytes));
        Ok(Record {
            id: TileId::new(level, row, column),
            summary,
            children,
            patch_codes: patch_codes.into(),
            voids: self.voids.then(|| voids.into()),
            cage: numbers(cage, self.cage_bytes),
            detail: numbers(detail, self.detail_bytes),
        })
    }
}

/// The narrowest width in bytes that holds a number: 1, 2 or 4. A level takes the widest of its numbers'.
///
/// The digits of a number are balanced, −128 to 127, so two of them reach from −0x8080 to 0x7f7f.
#[must_use]
pub const fn number_bytes(number: i32) -> u8 {
    match number {
        -0x80..=0x7f => 1,
        -0x8080..=0x7f7f => 2,
        _ => 4,
    }
}

fn put_summary(bytes: &mut Vec<u8>, summary: &Summary) {
    bytes.extend(summary.min.to_le_bytes());
    bytes.extend(summary.max.to_le_bytes());
    bytes.extend(summary.error.to_le_bytes());
    bytes.extend(summary.flags.to_le_bytes());
}

fn take_summary(rest: &mut &[u8]) -> Summary {
    Summary {
        min: i32::from_le_bytes(take(rest)),
        max: i32::from_le_bytes(take(rest)),
        error: f32::from_le_bytes(take(rest)),
        flags: u32::from_le_bytes(take(rest)),
    }
}

fn check_summary(summary: &Summary, whose: &str) -> Result<(), String> {
    let Summary {
        min,
        max,
        error,
        flags,
    } = *summary;
    if min > max {
        return Err(format!(
            "{whose}'s least height {min} is over its greatest {max}"
        ));
    }
    if !(error.is_finite() && error >= 0.0) {
        return Err(format!("{whose}'s error is {error} m"));
    }
    if flags & !(Summary::PRESENT | Summary::VOID | Summary::ALL_VOID | Summary::FEATURE) != 0 {
        return Err(format!(
            "{whose}'s flags are {flags:#x}, of which this version knows 0xf"
        ));
    }
    Ok(())
}

/// The next bytes; the caller has checked the record's length.
fn take<const N: usize>(rest: &mut &[u8]) -> [u8; N] {
    let mut out = [0; N];
    let (head, tail) = rest.split_at(N);
    out.copy_from_slice(head);
    *rest = tail;
    out
}

/// Writes numbers digit by digit: all lowest digits, then all second ones, and so on.
///
/// Digits to the base 256 are balanced: a small number, negative or not, has zeros for all but its lowest, so that a few
/// large numbers in a level cost the others next to nothing.
fn put_numbers(bytes: &mut Vec<u8>, numbers: &[i32], width: u8) {
    let worst = numbers.iter().map(|&number| number_bytes(number)).max();
    assert!(
        worst <= Some(width),
        "numbers of {worst:?} bytes at a level of {width}"
    );
    for place in 0..width {
        bytes.extend(numbers.iter().map(|&number| digit(number, place)));
    }
}

/// The balanced digit of a number at a place, as a byte: adding half a base at every place below makes carries of
/// what is over 127.
const fn digit(number: i32, place: u8) -> u8 {
    const HALVES: [i32; 4] = [0, 0x80, 0x8080, 0x80_8080];
    (number.wrapping_add(HALVES[place as usize]) >> (8 * place)).to_le_bytes()[0]
}

/// Reads what [`put_numbers`] wrote.
fn numbers(bytes: &[u8], width: u8) -> Box<[i32]> {
    let count = bytes.len() / usize::from(width);
    let (lowest, rest) = bytes.split_at(count);
    let mut numbers: Box<[i32]> = lowest
        .iter()
        .map(|byte| i32::from(byte.cast_signed()))
        .collect();
    for (place, plane) in (1..).zip(rest.chunks_exact(count)) {
        for (number, byte) in numbers.iter_mut().zip(plane) {
            *number = number.wrapping_add(i32::from(byte.cast_signed()) << (8 * place));
        }
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(voids: bool, cage_bytes: u8, detail_bytes: u8) -> RecordLayout {
        RecordLayout::new(&Level {
            tiles: [1, 1],
            step: 4,
            key: false,
            cage_bytes,
            detail_bytes,
            voids,
        })
    }

    fn with_parts<T>(f: impl FnOnce(&RecordParts<'_>) -> T) -> T {
        let ramp = |count: usize| {
            (0..count)
                .map(|i| i32::try_from(i % 255).unwrap() - 127)
                .collect::<Vec<_>>()
        };
        f(&RecordParts {
            id: TileId::new(3, 70_000, 5),
            summary: Summary {
                min: -5,
                max: 9,
                error: 0.5,
                flags: 3,
            },
            children: [
                Summary {
                    min: 1,
                    max: 2,
                    error: 0.25,
                    flags: 1,
                },
                Summary::default(),
                Summary::default(),
                Summary::default(),
            ],
            patch_codes: &[0x5f; PATCH_COUNT],
            voids: Some(&[0xa5; VOID_BYTES]),
            cage: &ramp(CAGE_CONTROL_COUNT),
            detail: &ramp(TILE_SAMPLE_COUNT),
        })
    }

    #[test]
    fn what_is_encoded_is_decoded_at_every_width() {
        for (voids, cage, detail) in [(true, 1, 1), (false, 2, 1), (true, 4, 2), (false, 1, 4)] {
            let layout = layout(voids, cage, detail);
            with_parts(|parts| {
                let bytes = layout.encode(parts);
                assert_eq!(bytes.len(), layout.byte_count());
                let record = layout.decode(&bytes).unwrap();
                assert_eq!(
                    (record.id, record.summary, record.children),
                    (parts.id, parts.summary, parts.children)
                );
                assert_eq!((&*record.cage, &*record.detail), (parts.cage, parts.detail));
                assert_eq!(record.patch_codes.as_ref(), parts.patch_codes);
                assert_eq!(record.voids.as_deref(), parts.voids.filter(|_| voids));
            });
        }
    }

    #[test]
    fn a_record_has_the_size_the_format_says() {
        assert_eq!(
            layout(false, 1, 1).byte_count(),
            12 + 80 + 1024 + 1225 + 16641
        );
        assert_eq!(
            layout(true, 4, 2).byte_count(),
            12 + 80 + 1024 + 2081 + 4 * 1225 + 2 * 16641
        );
    }

    #[test]
    fn every_other_length_is_an_error() {
        let layout = layout(true, 1, 1);
        let bytes = with_parts(|parts| layout.encode(parts));
        for length in 0..bytes.len() {
            assert!(layout.decode(&bytes[..length]).is_err());
        }
        assert!(layout.decode(&[bytes.as_slice(), &[0]].concat()).is_err());
    }

    #[test]
    fn impossible_summaries_are_errors() {
        let layout = layout(false, 1, 1);
        let bytes = with_parts(|parts| layout.encode(parts));
        for (at, value) in [
            (12, i32::MAX.to_le_bytes()),
            (20, f32::NAN.to_le_bytes()),
            (20, (-1_f32).to_le_bytes()),
            (24, 16_u32.to_le_bytes()),
            (0, 256_u32.to_le_bytes()),
        ] {
            let mut broken = bytes.clone();
            broken[at..at + 4].copy_from_slice(&value);
            assert!(layout.decode(&broken).is_err(), "{value:?} at {at}");
        }
    }

    #[test]
    fn any_byte_changed_changes_the_record_or_is_an_error() {
        let layout = layout(true, 1, 1);
        let bytes = with_parts(|parts| layout.encode(parts));
        let whole = layout.decode(&bytes).unwrap();
        for at in (0..bytes.len()).filter(|at| *at < 200 || at % 97 == 0) {
            let mut broken = bytes.clone();
            broken[at] ^= 0x10;
            assert!(layout.decode(&broken).as_ref() != Ok(&whole), "byte {at}");
        }
    }

    #[test]
    fn widths_are_the_narrowest_that_fit() {
        let widths = [
            -128,
            127,
            128,
            -129,
            32_639,
            -32_896,
            32_640,
            -32_897,
            i32::MIN,
        ]
        .map(number_bytes);
        assert_eq!(widths, [1, 1, 2, 2, 2, 2, 4, 4, 4]);
    }

    #[test]
    fn every_number_survives_its_digits() {
        let edges = [
            0,
            1,
            -1,
            127,
            128,
            -128,
            -129,
            255,
            256,
            32_639,
            -32_896,
            32_640,
            1 << 24,
            i32::MAX,
            i32::MIN,
        ];
        for width in [1, 2, 4] {
            let fit: Vec<i32> = edges
                .into_iter()
                .filter(|&edge| number_bytes(edge) <= width)
                .collect();
            let mut bytes = Vec::new();
            put_numbers(&mut bytes, &fit, width);
            assert_eq!(
                (bytes.len(), &*numbers(&bytes, width)),
                (fit.len() * usize::from(width), &*fit)
            );
        }
    }

    #[test]
    fn small_numbers_have_one_digit_at_every_width() {
        let small: Vec<i32> = (-128..128).collect();
        let mut bytes = Vec::new();
        put_numbers(&mut bytes, &small, 4);
        assert!(bytes[256..].iter().all(|&byte| byte == 0));
    }
}
