//! What a scene has and leaves out: its plan, and what the plan does not tell apart.

use super::place::Place;
use crate::geometry::ShapeKind;
use crate::integrator::LightChoice;
use crate::render::Job;

/// The part that chooses lights without asking all of them.
pub const CACHE_POINTS: &str = "cache points for lights";

/// A part of the renderer.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its name, in most cases that in the plan.
    pub name: &'static str,
    /// Whether this scene has it.
    pub is_built: bool,
    /// Why.
    pub reason: String,
}

/// What is to be known of a scene.
#[derive(Clone, Debug)]
pub struct Facts {
    /// The parts of the renderer.
    pub parts: Vec<Part>,
    /// Lights.
    pub lights: usize,
    /// Where something is out of the way; `None` in a scene without extent.
    pub place: Option<Place>,
}

impl Facts {
    /// Of a scene that was prepared for its plan alone.
    pub fn of(job: &Job) -> Self {
        let shapes = &job.world.geometry.shapes;
        let has = |of: fn(&ShapeKind) -> bool| shapes.iter().any(|shape| of(&shape.kind));
        let kind = |name, [yes, no]: [&str; 2], is_built: bool| {
            let reason = if is_built { yes } else { no }.to_owned();
            Part { name, is_built, reason }
        };
        let curves = has(|kind| matches!(kind, ShapeKind::Curves(_)));
        let round = has(|kind| matches!(kind, ShapeKind::Sphere(_) | ShapeKind::Disk(_) | ShapeKind::Cylinder(_)));
        let systems = &job.plan.systems;
        let mut parts: Vec<Part> = systems
            .iter()
            .map(|system| Part { name: system.name, is_built: system.built, reason: system.reason.clone() })
            .collect();
        parts.push(kind("curves", ["there are some", "the scene has no curves"], curves));
        parts.push(kind("spheres, disks", ["there are some", "the scene has no spheres or disks"], round));
        let choice = systems.iter().find(|system| system.name == "light selection");
        parts.push(Part {
            name: CACHE_POINTS,
            // Where only the plan is wanted, cache points are not there yet.
            is_built: matches!(job.world.light_choice, LightChoice::CachePoints(_) | LightChoice::Pilot),
            reason: choice.map_or(String::new(), |choice| choice.reason.clone()),
        });
        Self { parts, lights: job.world.lights.len(), place: Place::of(job) }
    }

    /// Whether the scene has the part called `name`.
    pub fn has(&self, name: &str) -> bool {
        self.parts.iter().any(|part| part.name == name && part.is_built)
    }
}
