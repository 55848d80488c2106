//! What happens along a path, event by event: for replaying a sample that went wrong. A path of a render records nothing, and asks once a
//! vertex whether it should.

use glam::Vec3;

use crate::light::LightId;
use crate::math::Rgb;

/// Paths may have millions of vertices: of what comes after so many events only the first value that is not finite is kept, and the end.
const MOST_EVENTS: usize = 4096;

/// Where a path is scattered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexKind {
    /// At a surface.
    Surface,
    /// In a medium.
    Medium,
}

/// One thing that happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// The path was scattered.
    Vertex {
        /// The number of the ray that came here; 1 is the camera's. Paths that go on from points drawn on the camera ray have numbers of their own.
        index: u32,
        /// Bounces, this one included.
        depth: u32,
        /// At what.
        kind: VertexKind,
        /// Where, in render space.
        p: Vec3,
        /// The path's throughput before it is scattered, over the mean pdf of the channels.
        throughput: Rgb,
        /// What the path has brought so far: emission met on the way here included, light gathered here not.
        so_far: Rgb,
    },
    /// A light was drawn at the last vertex.
    Light {
        /// The number of the ray that came to the vertex.
        index: u32,
        /// Which.
        light: LightId,
        /// The probability of drawing it.
        pmf: f32,
        /// What arrives from it, times the path's throughput and the weight of multiple importance sampling.
        brought: Rgb,
    },
    /// What surfaces and environments shine straight into the camera was found.
    Seen {
        /// It, as a mean over the path's own camera ray and those that asked for that alone.
        brought: Rgb,
    },
    /// The path ended.
    End {
        /// What it has brought in all.
        so_far: Rgb,
    },
}

impl Event {
    /// Whether all its values are.
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Vertex { p, throughput, so_far, .. } => p.is_finite() && throughput.is_finite() && so_far.is_finite(),
            Self::Light { pmf, brought, .. } => pmf.is_finite() && brought.is_finite(),
            Self::Seen { brought } => brought.is_finite(),
            Self::End { so_far } => so_far.is_finite(),
        }
    }
}

/// The events of a path, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathRecord {
    /// What happened.
    pub events: Vec<Event>,
    /// How many events were left out.
    pub left_out: u64,
    /// The place in `events` of the first that is not finite.
    pub first_fault: Option<usize>,
}

impl PathRecord {
    #[cold]
    pub(super) fn add(&mut self, event: Event) {
        let is_first_fault = self.first_fault.is_none() && !event.is_finite();
        if is_first_fault {
            self.first_fault = Some(self.events.len());
        }
        if self.events.len() < MOST_EVENTS || is_first_fault || matches!(event, Event::End { .. } | Event::Seen { .. })
        {
            self.events.push(event);
        } else {
            self.left_out += 1;
        }
    }
}
