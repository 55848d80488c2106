//! What was set out to be reached in a scene.

use super::bar::{Bar, Bound};
use super::curve::{Curve, Run};
use super::ratio::Ratio;
use super::report::SceneReport;

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

/// How many times a method's number is another's.
#[derive(Clone, Debug)]
pub struct Goal {
    /// The method whose number it is.
    pub of: &'static str,
    /// The other.
    pub over: &'static str,
    /// Which number.
    pub quantity: Quantity,
    /// What the ratio shall be.
    pub bound: Bound,
}

impl Goal {
    /// Judges it, if both methods were measured.
    pub fn judge(&self, scene: &SceneReport) -> Option<Bar> {
        let (of, over) = (scene.curve(self.of)?, scene.curve(self.over)?);
        let (what, ratio): (_, fn(&Curve, &Curve) -> Ratio) = match self.quantity {
            Quantity::Ttuv => ("TTUV", |a, b| a.ratio(b, |run| run.ttuv())),
            Quantity::GatheredTtuv => ("TTUV of gathered light", |a, b| a.ratio(b, Run::gathered_ttuv)),
            Quantity::GatheredRmse => ("RMSE of gathered light", |a, b| a.ratio(b, |run| run.errors.gathered_rmse)),
            Quantity::RenderingTime => ("CPU s of rendering", |a, b| a.ratio(b, |run| run.cost.cpu_seconds_rendering)),
        };
        let name = format!("{}: {what}, {} over {}", scene.name, self.of, self.over);
        Some(Bar::new(name, self.bound, ratio(of, over)))
    }
}
