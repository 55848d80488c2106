//! What the renderer set out to reach, and whether it did.

use lanternfish::bench::bar::{Bar, Bound};

use super::compare::{Quantity, Run, SceneResult};
use super::lamp::LampResult;
use super::many::ManyResult;
use super::variants::{AUTO, DEFAULTS, NO_VISIBILITY, NULL, NULL_WITHOUT_FIRES, OPTIMAL, TREE, UNIFORM, Variant};

/// How many times a variant's number is another's, in one scene.
struct Goal {
    what: &'static str,
    scene: &'static str,
    bound: Bound,
    of: Variant,
    over: Variant,
    quantity: Quantity,
}

fn goals() -> Vec<Goal> {
    use Bound::{AtLeast, AtMost};
    let mut goals = vec![];
    let mut add = |what, bars: &[(&'static str, f64)], bound: fn(f64) -> Bound, of, over, quantity: Quantity| {
        let goal = |&(scene, bar): &(&'static str, f64)| Goal { what, scene, bound: bound(bar), of, over, quantity };
        goals.extend(bars.iter().map(goal));
    };
    let all = |bar| [("pier", bar), ("foliage", bar), ("house", bar)];
    add(
        "TTUV: uniform over cache points",
        &[("pier", 2.0), ("foliage", 6.5), ("house", 3.5)],
        AtLeast,
        UNIFORM,
        DEFAULTS,
        Run::ttuv,
    );
    add(
        "TTUV: optimal over cache points",
        &[("pier", 10.0), ("foliage", 1.3), ("house", 1.4)],
        AtLeast,
        OPTIMAL,
        DEFAULTS,
        Run::ttuv,
    );
    add("RMSE: no visibility over optimal", &all(1.05), AtMost, NO_VISIBILITY, OPTIMAL, |run| run.errors.rmse);
    add(
        "RMSE: cache points over optimal",
        &[("pier", 1.0), ("foliage", 1.0), ("house", 0.85)],
        AtMost,
        DEFAULTS,
        OPTIMAL,
        |run| run.errors.rmse,
    );
    add("memory: cache points over uniform", &all(1.1), AtMost, DEFAULTS, UNIFORM, |run| run.cost.peak_memory);
    let tree = [("pier", 1.0), ("foliage", 1.0), ("house", 2.0), ("rooms", 2.0)];
    add("TTUV: tree over cache points", &tree, AtLeast, TREE, DEFAULTS, Run::ttuv);
    add(
        "TTUV, best 99.9 %: null without volume lights over null",
        &[("fire", 20.0), ("torch", 2.2)],
        AtLeast,
        NULL_WITHOUT_FIRES,
        NULL,
        Run::trimmed_ttuv,
    );
    let in_scatter =
        [("beams", 5.0), ("godrays", 5.0), ("torch", 1.8), ("fire", 0.95), ("cloud", 0.97), ("explosion", 0.95)];
    add("TTUV, best 99.9 %: null over auto", &in_scatter, AtLeast, NULL, AUTO, Run::trimmed_ttuv);
    add("CPU s: auto over null", &[("godrays", 1.25), ("cloud", 1.03)], AtMost, AUTO, NULL, |run| {
        run.cost.rendering_seconds
    });
    goals
}

/// Every bar that something was measured for.
pub fn bars(scenes: &[SceneResult], many: Option<&ManyResult>, lamp: Option<&LampResult>) -> Vec<Bar> {
    let of_scene = |goal: Goal| {
        let result = scenes.iter().find(|result| result.scene == goal.scene)?;
        let (way, other) = (result.way(goal.of)?, result.way(goal.over)?);
        Some(Bar::new(format!("{}, {}", goal.what, goal.scene), goal.bound, way.ratio(other, goal.quantity)))
    };
    let mut bars: Vec<Bar> = goals().into_iter().filter_map(of_scene).collect();
    if let Some(many) = many {
        let [few, much] = many.counts();
        let name = format!("CPU time a sample: {much} lights over {few}");
        bars.push(Bar::new(name, Bound::AtMost(1.3), many.ratio));
    }
    if let Some(lamp) = lamp {
        bars.push(Bar::new("wall time: auto over uniform, lamp".to_owned(), Bound::AtMost(1.02), lamp.wall));
    }
    bars
}
