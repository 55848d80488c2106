//! What was set out to be reached in a scene.

use super::bar::{Bar, Bound};
use super::curve::{Curve, Run};
use super::ratio::Ratio;
use super::report::SceneReport;
use super::slope;

/// A number that is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// RMSE² × minutes of processor time.
    Ttuv,
    /// The same of gathered light: what chooses lights has no part in how lamps look that are in plain sight.
    GatheredTtuv,
    /// The RMSE of gathered light.
    GatheredRmse,
    /// Processor seconds of rendering alone.
    RenderingTime,
}

/// What a number shall be.
#[derive(Clone, Debug)]
pub enum Goal {
    /// How many times a method's number is another's.
    Times {
        /// The method whose number it is.
        of: &'static str,
        /// The other.
        over: &'static str,
        /// Which number.
        quantity: Quantity,
        /// What the ratio shall be.
        bound: Bound,
    },
    /// That the error of the method falls as t^-1/2 once what it learns is learned: an unbiased one's does.
    Slope {
        /// The method.
        of: &'static str,
    },
}

impl Goal {
    /// The methods that have to be measured for it.
    pub fn methods(&self) -> Vec<&'static str> {
        match *self {
            Self::Times { of, over, .. } => vec![of, over],
            Self::Slope { of } => vec![of],
        }
    }

    /// Judges it, if all its methods were measured.
    pub fn judge(&self, scene: &SceneReport) -> Option<Bar> {
        match *self {
            Self::Times { of, over, quantity, bound } => {
                let (a, b) = (scene.curve(of)?, scene.curve(over)?);
                let (what, ratio): (_, fn(&Curve, &Curve) -> Ratio) = match quantity {
                    Quantity::Ttuv => ("TTUV", |a, b| a.ratio(b, |run| run.ttuv())),
                    Quantity::GatheredTtuv => ("TTUV of gathered light", |a, b| a.ratio(b, Run::gathered_ttuv)),
                    Quantity::GatheredRmse => {
                        ("RMSE of gathered light", |a, b| a.ratio(b, |run| run.errors.gathered_rmse))
                    }
                    Quantity::RenderingTime => {
                        ("CPU s of rendering", |a, b| a.ratio(b, |run| run.cost.cpu_seconds_rendering))
                    }
                };
                Some(Bar::new(format!("{}: {what}, {of} over {over}", scene.name), bound, ratio(a, b)))
            }
            Self::Slope { of } => {
                let slope = &scene.curve(of)?.slope;
                let [low, high] = slope.interval.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                let measured = Ratio { value: slope.value.unwrap_or(f64::NAN), low, high };
                let bound = Bound::Within(slope::EXPECTED - slope::TOLERANCE, slope::EXPECTED + slope::TOLERANCE);
                Some(Bar::new(format!("{}: slope of log RMSE over log time, {of}", scene.name), bound, measured))
            }
        }
    }
}
