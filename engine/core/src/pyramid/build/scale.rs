//! How heights become integers: the unit u and the code step q, settled from the error bound.

use crate::pyramid::PyramidError;

/// The largest half step, in units: steps of all levels stay far from overflow.
const MAX_HALF_STEP: f64 = 32_768.0;

/// How heights become integers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// The unit u is 2^this metres.
    pub(super) unit_exponent: i32,
    /// Units a code step of the finest level: q.
    pub(super) step: i32,
    /// The error bound in metres.
    pub(super) eps: f64,
}

impl Scale {
    /// The scale for an error bound and a unit in metres, or their defaults; `integer` for sources in whole metres.
    ///
    /// u is the largest power of two that is at most eps / 8. q is the largest integer with ⌊q / 2⌋ u + r ≤ eps, where
    /// r = u / 2 if the source is not in whole units, else 0. The default bound of whole metres is the largest of this
    /// kind that rounding undoes: under half a metre.
    ///
    /// # Errors
    /// [`PyramidError::Refused`] for a bound or unit out of range or that do not go together.
    pub(super) fn new(
        eps: Option<f64>,
        unit: Option<f64>,
        integer: bool,
    ) -> Result<Self, PyramidError> {
        let undone = eps.is_none() && integer;
        // 15/32 m: units of 1/32 m and fifteen of them either way.
        let eps = eps.unwrap_or(if integer { 0.468_75 } else { 0.1 });
        if !(1e-6..=1e6).contains(&eps) {
            return refuse(format!(
                "an error bound of {eps} m is outside 0.000001 to 1,000,000 m"
            ));
        }
        let unit = unit.unwrap_or_else(|| (eps / 8.0).log2().floor().exp2());
        let exponent = unit.log2();
        if !(-24.0..=16.0).contains(&exponent) || exponent.fract() != 0.0 {
            return refuse(format!(
                "a unit of {unit} m is not a power of two from 2^-24 to 2^16 m"
            ));
        }
        let rounding = if integer && unit <= 1.0 {
            0.0
        } else {
            unit / 2.0
        };
        let half = if undone && unit <= 0.5 {
            0.5 / unit - 1.0
        } else {
            ((eps - rounding) / unit).floor()
        };
        if half < 0.0 {
            return refuse(format!(
                "a unit of {unit} m is too coarse for an error bound of {eps} m"
            ));
        }
        let half = half.min(MAX_HALF_STEP);
        let eps = if undone { half * unit + rounding } else { eps };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "whole numbers, checked above"
        )]
        Ok(Self {
            unit_exponent: exponent as i32,
            step: 2 * half as i32 + 1,
            eps,
        })
    }

    /// One unit in metres.
    pub(super) fn unit(&self) -> f64 {
        f64::from(self.unit_exponent).exp2()
    }

    /// Units a code step of a level: doubled with every level up from the finest, as far as that makes sense.
    pub(super) fn step_at(&self, levels_up: u8) -> i32 {
        let step = i64::from(self.step) << levels_up.min(31);
        i32::try_from(step.min(1 << 24)).unwrap_or(1 << 24)
    }
}

fn refuse(what: String) -> Result<Scale, PyramidError> {
    Err(PyramidError::Refused(what))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(eps: Option<f64>, unit: Option<f64>, integer: bool) -> (f64, i32) {
        let scale = Scale::new(eps, unit, integer).unwrap();
        (scale.unit(), scale.step)
    }

    #[test]
    fn the_step_is_the_largest_within_the_bound() {
        assert_eq!(parts(Some(4.0), None, true), (0.5, 17));
        assert_eq!(parts(Some(2.0), Some(1.0 / 16.0), true), (1.0 / 16.0, 65));
        assert_eq!(parts(Some(0.25), None, false), (1.0 / 32.0, 15));
        assert_eq!(parts(Some(32.0), None, true), (4.0, 15));
    }

    #[test]
    fn whole_metres_come_back_by_default() {
        let scale = Scale::new(None, None, true).unwrap();
        assert_eq!(
            (scale.unit(), scale.step, scale.eps),
            (1.0 / 32.0, 31, 0.468_75)
        );
        assert!(f64::from(scale.step / 2) * scale.unit() < 0.5);
        let finer = Scale::new(None, Some(1.0 / 256.0), true).unwrap();
        assert_eq!((finer.step, finer.eps), (255, 127.0 / 256.0));
    }

    #[test]
    fn nonsense_is_refused() {
        for (eps, unit) in [
            (Some(0.0), None),
            (Some(f64::NAN), None),
            (Some(-1.0), None),
            (None, Some(0.3)),
            (Some(0.1), Some(1.0)),
        ] {
            assert!(Scale::new(eps, unit, false).is_err(), "{eps:?} {unit:?}");
        }
    }

    #[test]
    fn steps_double_and_never_overflow() {
        let scale = Scale::new(Some(4.0), None, true).unwrap();
        assert_eq!(scale.step_at(3), 136);
        assert_eq!(scale.step_at(40), 1 << 24);
    }
}
