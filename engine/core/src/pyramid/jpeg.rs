//! A colour tile as JPEG, seamless beside others: neighbours share border texels, and agree on them once decoded.
//!
//! ```text
//! SOI │ APP0 │ APP9: the tile's border │ DQT … SOF │ DHT … SOS │ data │ EOI        a JPEG like any other
//!              │
//!              └ "drumlin" 0 │ corners, RGB: NW NE SW SE │ SOF … SOS │ data         of a JPEG of 256 × 32, whose
//!                                                                                   tables are the tile's own
//! ```
//!
//! JPEG's noise differs from tile to tile, so the border is stored once more as a function of its own texels alone: each
//! side is drawn as eight equal rows, which is one row of blocks, no texel of which depends on another side. Coefficients
//! of equal rows are √8 times as large as those of one row's texels; their quantisers are three times as coarse.
//! Corners, which belong to two sides and four tiles, are stored as they are.
//!
//! The encoder's SIMD gives other bytes than its plain code does, so it is left off: bytes do not depend on the machine.
//!
//! Knows texels and bytes; knows no file.

use std::io::Cursor;

use ::image::codecs::jpeg::JpegDecoder;
use ::image::{DynamicImage, ImageDecoder};
use jpeg_encoder::{ColorType, Encoder, EncodingError, QuantizationTableType, SamplingFactor};

use super::COLOR_TEXELS;

/// From this quality on colours are stored at every texel, below it at every second one each way.
const FULL_COLOR_QUALITY: u8 = 90;
/// Begins the segment of the border.
const BORDER_NAME: &[u8] = b"drumlin\0";
/// The segment of the border: the ninth for applications.
const APP9: u8 = 0xe9;
const CORNERS: [[usize; 2]; 4] = [[0, 0], [0, LAST], [LAST, 0], [LAST, LAST]];
const LAST: usize = COLOR_TEXELS - 1;
/// Rows a side of the border is drawn as.
const SIDE_ROWS: usize = 8;
/// Times as coarse as the tile's are the quantisers of its border.
const BORDER_QUANTISER: u16 = 3;

const START: [u8; 2] = [0xff, 0xd8];
const END: [u8; 2] = [0xff, 0xd9];
const APP0: u8 = 0xe0;
const QUANTISERS: u8 = 0xdb;
const HUFFMAN: u8 = 0xc4;
const SCAN: u8 = 0xda;

type Rgb = [u8; 3];

/// Encodes 256 × 256 texels of RGBA; alpha is not stored, and colours where it is 0 are not kept.
///
/// # Errors
///
/// What the encoder says, in words.
pub(super) fn encode(texels: &[u8], quality: u8) -> Result<Vec<u8>, String> {
    let (texels, _) = texels.as_chunks::<4>();
    assert_eq!(
        texels.len(),
        COLOR_TEXELS * COLOR_TEXELS,
        "texels of a tile"
    );
    let main = compress(&filled(texels, COLOR_TEXELS, 16), quality, None).map_err(message)?;
    let parts = Parts::of(&main)?;
    let sides: Vec<[u8; 4]> = (0..4)
        .flat_map(|side| (0..SIDE_ROWS).map(move |_| side))
        .flat_map(|side| (0..COLOR_TEXELS).map(move |at| texels[on_side(side, at)]))
        .collect();
    let sides = filled(&sides, COLOR_TEXELS, SIDE_ROWS);
    let border = compress(&sides, quality, Some(&parts)).map_err(message)?;
    let mut payload = BORDER_NAME.to_vec();
    for [row, column] in CORNERS {
        payload.extend(&texels[row * COLOR_TEXELS + column][..3]);
    }
    for segment in Parts::of(&border)?.segments {
        if !matches!(segment.marker, QUANTISERS | HUFFMAN | APP0) {
            payload.extend(segment.bytes);
        }
    }
    let length = u16::try_from(payload.len() + 2)
        .map_err(|_| format!("a border of {} bytes", payload.len()))?;
    let mut bytes = START.to_vec();
    for (index, segment) in parts.segments.iter().enumerate() {
        if index == 1 {
            bytes.extend([0xff, APP9]);
            bytes.extend(length.to_be_bytes());
            bytes.extend(&payload);
        }
        bytes.extend(segment.bytes);
    }
    bytes.extend(END);
    Ok(bytes)
}

/// The texels of a tile, 256 × 256 of opaque RGBA.
///
/// # Errors
///
/// Where the bytes are not what [`encode`] makes: what, in words.
pub(super) fn decode(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let parts = Parts::of(bytes)?;
    let mut texels = decompress(bytes, [COLOR_TEXELS, COLOR_TEXELS])?;
    let border = parts
        .segments
        .iter()
        .filter(|segment| segment.marker == APP9)
        .find_map(|segment| segment.bytes[4..].strip_prefix(BORDER_NAME))
        .ok_or("the JPEG has no border of its own")?;
    let (corners, frame) = border
        .split_at_checked(3 * CORNERS.len())
        .ok_or("the JPEG's border is cut short")?;
    let mut file = START.to_vec();
    for segment in &parts.segments {
        match segment.marker {
            QUANTISERS => file.extend(coarser(segment.bytes)),
            HUFFMAN => file.extend(segment.bytes),
            _ => {}
        }
    }
    file.extend(frame);
    file.extend(END);
    let sides = decompress(&file, [4 * SIDE_ROWS, COLOR_TEXELS])?;
    for side in 0..4 {
        for at in 0..COLOR_TEXELS {
            texels[on_side(side, at)] = sides[side * SIDE_ROWS * COLOR_TEXELS + at];
        }
    }
    for ([row, column], corner) in CORNERS.into_iter().zip(corners.as_chunks::<3>().0) {
        texels[row * COLOR_TEXELS + column] = *corner;
    }
    Ok(texels
        .iter()
        .flat_map(|&[r, g, b]| [r, g, b, u8::MAX])
        .collect())
}

/// The texel at a place of a side: north, south, west, east.
const fn on_side(side: usize, at: usize) -> usize {
    match side {
        0 => at,
        1 => LAST * COLOR_TEXELS + at,
        2 => at * COLOR_TEXELS,
        _ => at * COLOR_TEXELS + LAST,
    }
}

/// The colours, and where there is nothing the mean of what is there in the same square: so that what is not seen takes
/// few bytes and makes no noise beside what is.
fn filled(texels: &[[u8; 4]], columns: usize, square: usize) -> Vec<Rgb> {
    let rgb = |&[r, g, b, _]: &[u8; 4]| [r, g, b];
    let mut colors: Vec<Rgb> = texels.iter().map(rgb).collect();
    if texels.iter().all(|texel| texel[3] > 0) {
        return colors;
    }
    for first_row in (0..texels.len() / columns).step_by(square) {
        let mut fill = [128; 3];
        for first_column in (0..columns).step_by(square) {
            let inside = || {
                (first_row..first_row + square).flat_map(move |row| {
                    (first_column..first_column + square).map(move |column| row * columns + column)
                })
            };
            let there: Vec<Rgb> = inside()
                .filter(|&at| texels[at][3] > 0)
                .map(|at| colors[at])
                .collect();
            if let Ok(count @ 1..) = u32::try_from(there.len()) {
                fill = [0, 1, 2].map(|channel| {
                    let sum: u32 = there.iter().map(|color| u32::from(color[channel])).sum();
                    u8::try_from(sum / count).unwrap_or(u8::MAX)
                });
            }
            inside()
                .filter(|&at| texels[at][3] == 0)
                .for_each(|at| colors[at] = fill);
        }
    }
    colors
}

/// Compresses an image as wide as a tile; as a border where the tile's own is given.
fn compress(
    colors: &[Rgb],
    quality: u8,
    tile: Option<&Parts<'_>>,
) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, quality);
    let full = quality >= FULL_COLOR_QUALITY || tile.is_some();
    encoder.set_sampling_factor(if full {
        SamplingFactor::F_1_1
    } else {
        SamplingFactor::F_2_2
    });
    if let Some([luma, chroma]) = tile.and_then(Parts::border_quantisers) {
        encoder.set_quantization_tables(luma, chroma);
    }
    let [rows, columns] = [colors.len() / COLOR_TEXELS, COLOR_TEXELS]
        .map(|side| u16::try_from(side).unwrap_or(u16::MAX));
    encoder.encode(colors.as_flattened(), columns, rows, ColorType::Rgb)?;
    Ok(bytes)
}

fn message(error: EncodingError) -> String {
    format!("JPEG: {error}")
}

fn decompress(bytes: &[u8], [rows, columns]: [usize; 2]) -> Result<Vec<Rgb>, String> {
    let damaged = |error: ::image::ImageError| format!("the JPEG does not decode: {error}");
    let decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    if [height as usize, width as usize] != [rows, columns] {
        return Err(format!(
            "a JPEG of {width} x {height} texels, not {columns} x {rows}"
        ));
    }
    let image = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    Ok(image.into_rgb8().into_raw().as_chunks().0.to_vec())
}

/// A segment of quantisers (of 8 bits, one table) for the border.
fn coarser(segment: &[u8]) -> Vec<u8> {
    let coarser =
        |value: &u8| u8::try_from(u16::from(*value) * BORDER_QUANTISER).unwrap_or(u8::MAX);
    let (head, table) = segment.split_at(segment.len().min(5));
    head.iter()
        .copied()
        .chain(table.iter().map(coarser))
        .collect()
}

/// The segments of a JPEG between its start and its end; the last holds the data.
struct Parts<'a> {
    segments: Vec<Segment<'a>>,
}

struct Segment<'a> {
    marker: u8,
    /// From its marker on.
    bytes: &'a [u8],
}

impl<'a> Parts<'a> {
    fn of(jpeg: &'a [u8]) -> Result<Self, String> {
        let damaged = || "is no JPEG of segments".to_owned();
        let inside = jpeg
            .strip_prefix(&START)
            .and_then(|rest| rest.strip_suffix(&END));
        let mut rest = inside.ok_or_else(damaged)?;
        let mut segments = Vec::new();
        while !rest.is_empty() {
            let [0xff, marker, high, low, ..] = *rest else {
                return Err(damaged());
            };
            let length = 2 + usize::from(u16::from_be_bytes([high, low]));
            if length < 4 || length > rest.len() {
                return Err(damaged());
            }
            let bytes = if marker == SCAN {
                rest
            } else {
                &rest[..length]
            };
            segments.push(Segment { marker, bytes });
            rest = &rest[bytes.len()..];
        }
        Ok(Self { segments })
    }

    /// The quantisers of the border, luma and chroma.
    fn border_quantisers(&self) -> Option<[QuantizationTableType; 2]> {
        let mut tables = self
            .segments
            .iter()
            .filter(|segment| segment.marker == QUANTISERS)
            .map(|segment| coarser(segment.bytes));
        let mut next = || {
            let segment = tables.next()?;
            let mut table = Box::new([0_u16; 64]);
            for (value, place) in segment.get(5..69)?.iter().zip(ZIGZAG) {
                table[usize::from(place)] = u16::from(*value);
            }
            Some(QuantizationTableType::Custom(table))
        };
        Some([next()?, next()?])
    }
}

/// The order in which a JPEG stores the 8 × 8 numbers of a table.
const ZIGZAG: [u8; 64] = [
    0, 1, 8, 16, 9, 2, 3, 10, 17, 24, 32, 25, 18, 11, 4, 5, 12, 19, 26, 33, 40, 48, 41, 34, 27, 20,
    13, 6, 7, 14, 21, 28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23, 30, 37, 44, 51, 58, 59,
    52, 45, 38, 31, 39, 46, 53, 60, 61, 54, 47, 55, 62, 63,
];

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "test pictures wrap")]
mod tests {
    use super::*;

    /// A tile of a smooth picture with edges, from a row and column of it on.
    fn tile(row: usize, column: usize) -> Vec<u8> {
        let texel = |row: usize, column: usize| {
            let wave = 60.0 * ((row as f64) / 9.0).sin() + 50.0 * ((column as f64) / 23.0).cos();
            let step = if (row / 40 + column / 56).is_multiple_of(2) {
                0.0
            } else {
                70.0
            };
            [90.0 + step * 0.8, 60.0 + wave * 0.3 + step, 120.0]
                .map(|base| (base + wave * 0.5) as u8)
        };
        (0..COLOR_TEXELS * COLOR_TEXELS)
            .flat_map(|at| {
                let [r, g, b] = texel(row + at / COLOR_TEXELS, column + at % COLOR_TEXELS);
                [r, g, b, 255]
            })
            .collect()
    }

    fn at(texels: &[u8], row: usize, column: usize) -> &[u8] {
        &texels[(row * COLOR_TEXELS + column) * 4..][..4]
    }

    #[test]
    fn neighbours_agree_on_the_texels_they_share_and_all_are_near_the_picture() {
        for quality in [30, 75, 90, 100] {
            let decoded =
                |row, column| decode(&encode(&tile(row, column), quality).unwrap()).unwrap();
            let [own, east, south, beyond] = [(0, 0), (0, LAST), (LAST, 0), (LAST, LAST)]
                .map(|(row, column)| decoded(row, column));
            for place in 0..COLOR_TEXELS {
                assert_eq!(
                    at(&own, place, LAST),
                    at(&east, place, 0),
                    "{quality}: row {place}"
                );
                assert_eq!(
                    at(&own, LAST, place),
                    at(&south, 0, place),
                    "{quality}: column {place}"
                );
            }
            assert_eq!(at(&own, LAST, LAST), at(&beyond, 0, 0));
            let source = tile(0, 0);
            let mean = |places: &[usize]| {
                let square = |&at: &usize| f64::from(own[at].abs_diff(source[at])).powi(2);
                (places.iter().map(square).sum::<f64>() / places.len() as f64).sqrt()
            };
            let side: Vec<usize> = (0..4 * COLOR_TEXELS)
                .flat_map(|at| {
                    let first = 4 * on_side(at / COLOR_TEXELS, at % COLOR_TEXELS);
                    first..first + 3
                })
                .collect();
            let all: Vec<usize> = (0..source.len()).collect();
            // The border is no worse than the rest by more than half, at any quality.
            assert!(
                mean(&side) < 1.5 * mean(&all) + 0.5,
                "{quality}: {} {}",
                mean(&side),
                mean(&all)
            );
            assert!(mean(&all) < 8.0, "{quality}: {}", mean(&all));
        }
    }

    #[test]
    fn the_border_s_quantisers_are_the_tile_s_made_coarser() {
        let main = compress(
            &filled(tile(0, 0).as_chunks().0, COLOR_TEXELS, 16),
            75,
            None,
        )
        .unwrap();
        let parts = Parts::of(&main).unwrap();
        let border = compress(&[[7; 3]; 32 * COLOR_TEXELS], 75, Some(&parts)).unwrap();
        let quantisers = |parts: &Parts<'_>, change: fn(&[u8]) -> Vec<u8>| -> Vec<Vec<u8>> {
            let own = parts
                .segments
                .iter()
                .filter(|segment| segment.marker == QUANTISERS);
            own.map(|segment| change(segment.bytes)).collect()
        };
        let stored = quantisers(&Parts::of(&border).unwrap(), <[u8]>::to_vec);
        assert_eq!(stored, quantisers(&parts, coarser));
        assert_eq!(stored.len(), 2);
    }

    #[test]
    fn what_is_not_seen_takes_few_bytes_and_spoils_nothing() {
        let mut half = tile(0, 0);
        for (at, texel) in half.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            if (at % COLOR_TEXELS + at / COLOR_TEXELS) > 230 {
                *texel = [0; 4];
            }
        }
        let bytes = encode(&half, 85).unwrap();
        assert!(bytes.len() < encode(&tile(0, 0), 85).unwrap().len());
        let decoded = decode(&bytes).unwrap();
        for (at, (texel, source)) in decoded.chunks(4).zip(half.chunks(4)).enumerate() {
            let near = (0..3).all(|channel| texel[channel].abs_diff(source[channel]) < 60);
            assert!(source[3] == 0 || near, "{at}: {texel:?} {source:?}");
        }
    }

    #[test]
    fn every_length_and_many_flipped_bits_are_an_error_or_a_picture_and_never_a_panic() {
        let bytes = encode(&tile(3, 5), 50).unwrap();
        for length in (0..bytes.len()).step_by(7) {
            assert!(decode(&bytes[..length]).is_err(), "{length} bytes");
        }
        for bit in (0..8 * bytes.len()).step_by(61) {
            let mut broken = bytes.clone();
            broken[bit / 8] ^= 1 << (bit % 8);
            let decoded = decode(&broken);
            assert!(decoded.is_err() || decoded.is_ok_and(|texels| texels.len() == 262_144));
        }
    }
}
