//! Stored numbers and how they become heights.

/// Numbers as a file stores them.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Samples {
    U8(Vec<u8>),
    I8(Vec<i8>),
    U16(Vec<u16>),
    I16(Vec<i16>),
    U32(Vec<u32>),
    I32(Vec<i32>),
    U64(Vec<u64>),
    I64(Vec<i64>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// The type of stored numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SampleType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
}

/// No surface has a height of this many metres: what is beyond is a mark for void, or damage.
const ABSURD_HEIGHT: f64 = 1e30;

/// From a stored number to metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scaling {
    /// The stored number that means void.
    pub(super) nodata: Option<f64>,
    /// Metres a stored unit, times `divisor`.
    pub(super) scale: f64,
    /// 10 for decimetres, and so on: 7191 / 10 is the nearest number to 719.1, and 7191 × 0.1 is not.
    pub(super) divisor: f64,
    /// Metres at the stored number 0.
    pub(super) offset: f64,
}

impl Scaling {
    #[cfg(test)]
    /// Stored numbers are metres and none is void.
    pub(super) const METRES: Self = Self {
        nodata: None,
        scale: 1.0,
        divisor: 1.0,
        offset: 0.0,
    };

    /// Numbers of so many metres a unit.
    pub(super) fn new(nodata: Option<f64>, scale: f64, offset: f64) -> Self {
        let whole = scale.recip().round();
        if scale < 1.0 && (scale * whole - 1.0).abs() < 1e-12 {
            Self {
                nodata,
                scale: 1.0,
                divisor: whole,
                offset,
            }
        } else {
            Self {
                nodata,
                scale,
                divisor: 1.0,
                offset,
            }
        }
    }

    /// All of it in one line.
    pub(super) fn label(&self) -> String {
        let Self {
            nodata,
            scale,
            divisor,
            offset,
        } = self;
        format!("{scale} / {divisor} + {offset}, void {nodata:?}")
    }

    /// True when whole stored numbers become whole metres.
    pub(super) fn is_whole(&self) -> bool {
        self.divisor == 1.0 && self.scale.fract() == 0.0 && self.offset.fract() == 0.0
    }

    /// The height of a stored number; NaN where it is void or no number.
    pub(super) fn height(&self, stored: f64) -> f64 {
        if self.nodata == Some(stored) || stored.is_nan() || stored.abs() >= ABSURD_HEIGHT {
            return f64::NAN;
        }
        let height = stored * self.scale / self.divisor + self.offset;
        if height.is_finite() { height } else { f64::NAN }
    }

    /// The same, with the void mark rounded to what an f32 can hold.
    fn for_f32(self) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "rounding to f32 is what is asked for"
        )]
        let round = |value: f64| f64::from(value as f32);
        Self {
            nodata: self.nodata.map(round),
            ..self
        }
    }
}

impl Samples {
    /// Bytes the numbers take in memory.
    pub(super) fn byte_len(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::I8(v) => v.len(),
            Self::U16(v) => v.len() * 2,
            Self::I16(v) => v.len() * 2,
            Self::U32(v) => v.len() * 4,
            Self::I32(v) => v.len() * 4,
            Self::U64(v) => v.len() * 8,
            Self::I64(v) => v.len() * 8,
            Self::F32(v) => v.len() * 4,
            Self::F64(v) => v.len() * 8,
        }
    }

    /// Heights of the numbers from `first` on, as many as `out` holds.
    pub(super) fn heights(&self, first: usize, scaling: &Scaling, out: &mut [f64]) {
        fn fill<T: Copy>(stored: &[T], out: &mut [f64], height: impl Fn(T) -> f64) {
            for (out, &stored) in out.iter_mut().zip(stored) {
                *out = height(stored);
            }
        }
        let range = first..first + out.len();
        let f32_scaling = scaling.for_f32();
        match self {
            Self::U8(v) => fill(&v[range], out, |x| scaling.height(x.into())),
            Self::I8(v) => fill(&v[range], out, |x| scaling.height(x.into())),
            Self::U16(v) => fill(&v[range], out, |x| scaling.height(x.into())),
            Self::I16(v) => fill(&v[range], out, |x| scaling.height(x.into())),
            Self::U32(v) => fill(&v[range], out, |x| scaling.height(x.into())),
            Self::I32(v) => fill(&v[range], out, |x| scaling.height(x.into())),
            Self::U64(v) => fill(&v[range], out, |x| scaling.height(x as f64)),
            Self::I64(v) => fill(&v[range], out, |x| scaling.height(x as f64)),
            Self::F32(v) => fill(&v[range], out, |x| f32_scaling.height(x.into())),
            Self::F64(v) => fill(&v[range], out, |x| scaling.height(x)),
        }
    }

    /// Numbers from their bytes; a last incomplete number is left out.
    pub(super) fn from_bytes(bytes: &[u8], kind: SampleType, big_endian: bool) -> Self {
        macro_rules! numbers {
            ($variant:ident, $type:ty) => {{
                let chunks = bytes.as_chunks().0.iter().copied();
                let from = if big_endian {
                    <$type>::from_be_bytes
                } else {
                    <$type>::from_le_bytes
                };
                Self::$variant(chunks.map(from).collect())
            }};
        }
        match kind {
            SampleType::U8 => Self::U8(bytes.to_vec()),
            SampleType::I8 => numbers!(I8, i8),
            SampleType::U16 => numbers!(U16, u16),
            SampleType::I16 => numbers!(I16, i16),
            SampleType::U32 => numbers!(U32, u32),
            SampleType::I32 => numbers!(I32, i32),
            SampleType::F32 => numbers!(F32, f32),
            SampleType::F64 => numbers!(F64, f64),
        }
    }
}

impl SampleType {
    /// Bytes of one number.
    pub(super) const fn bytes(self) -> u32 {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// True for whole numbers.
    pub(super) const fn is_whole(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn void_is_what_the_file_says_and_what_is_no_height() {
        let scaling = Scaling::new(Some(-9999.0), 0.1, -5.0);
        let mut out = [0.0; 5];
        Samples::F32(vec![-9999.0, f32::NAN, f32::INFINITY, f32::MIN, 50.0])
            .heights(0, &scaling, &mut out);
        assert!(out[..4].iter().all(|height| height.is_nan()));
        assert_eq!(out[4], 0.0);
    }

    #[test]
    fn a_void_mark_that_an_f32_cannot_hold_still_matches() {
        let scaling = Scaling {
            nodata: Some(-9999.1),
            ..Scaling::METRES
        };
        let mut out = [0.0];
        Samples::F32(vec![-9999.1]).heights(0, &scaling, &mut out);
        assert!(out[0].is_nan());
    }

    #[test]
    fn whole_numbers_come_out_exactly_in_either_byte_order() {
        for (big_endian, bytes) in [
            (true, [0xff, 0xfe, 0x12, 0x34]),
            (false, [0xfe, 0xff, 0x34, 0x12]),
        ] {
            let samples = Samples::from_bytes(&bytes, SampleType::I16, big_endian);
            assert_eq!(samples, Samples::I16(vec![-2, 0x1234]));
        }
    }
}
