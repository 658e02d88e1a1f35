//! Tiles on their way up: packed into words as `shaders/shared/upload.wgsl` says.

use drumlin_core::{
    geo::{CAGE_CONTROL_COUNT, PATCH_COUNT, TILE_SAMPLE_COUNT},
    pyramid::Tile,
};

/// Words of the void bits.
const VOID_WORDS: usize = TILE_SAMPLE_COUNT.div_ceil(32);
/// Words of a tile.
pub(crate) const UPLOAD_WORDS: usize =
    CAGE_CONTROL_COUNT + TILE_SAMPLE_COUNT + VOID_WORDS + PATCH_COUNT / 4;

/// Appends the words of a tile: controls, codes, void bits, patch errors. Short parts are filled with zeros.
pub(crate) fn pack(tile: &Tile, words: &mut Vec<u32>) {
    let start = words.len();
    let mut end = start + CAGE_CONTROL_COUNT;
    words.extend(tile.controls.iter().map(|control| control.cast_unsigned()));
    words.resize(end, 0);
    end += TILE_SAMPLE_COUNT;
    words.extend(tile.detail.iter().map(|code| code.cast_unsigned()));
    words.resize(end, 0);
    end += VOID_WORDS;
    pack_bytes(tile.voids.as_deref().unwrap_or(&[]), words);
    words.resize(end, 0);
    end += PATCH_COUNT / 4;
    pack_bytes(&tile.patch_codes, words);
    words.resize(end, 0);
}

/// Four bytes a word, lowest first.
fn pack_bytes(bytes: &[u8], words: &mut Vec<u32>) {
    words.extend(bytes.chunks(4).map(|chunk| {
        let mut word = [0; 4];
        word[..chunk.len()].copy_from_slice(chunk);
        u32::from_le_bytes(word)
    }));
}

#[cfg(test)]
mod tests {
    use drumlin_core::{geo::TileId, pyramid::Summary};

    use super::*;

    fn tile(voids: Option<Box<[u8]>>) -> Tile {
        Tile {
            id: TileId::ROOT,
            summary: Summary::default(),
            children: [Summary::default(); 4],
            step: 1,
            controls: vec![-1; CAGE_CONTROL_COUNT].into(),
            detail: vec![2; TILE_SAMPLE_COUNT].into(),
            patch_codes: vec![0x31; PATCH_COUNT].into(),
            voids,
        }
    }

    #[test]
    fn every_part_starts_where_the_shader_looks_for_it() {
        let mut words = Vec::new();
        pack(
            &tile(Some(vec![0xff; TILE_SAMPLE_COUNT.div_ceil(8)].into())),
            &mut words,
        );
        assert_eq!(words.len(), UPLOAD_WORDS);
        assert_eq!(
            [words[0], words[1224], words[1225]],
            [u32::MAX, u32::MAX, 2]
        );
        assert_eq!(
            [words[17_865], words[17_866], words[18_387]],
            [2, u32::MAX, 0x3131_3131]
        );
    }

    #[test]
    fn a_tile_without_voids_has_zeros_there() {
        let mut words = vec![7];
        pack(&tile(None), &mut words);
        assert_eq!([words[1 + 17_866], words[1 + 18_386]], [0, 0]);
    }
}
