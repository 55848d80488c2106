//! Which vertices lie at one place: those with the very same coordinates.

use glam::DVec3;
use rayon::prelude::*;

/// All vertices, those at one place behind one another.
pub struct Places {
    order: Vec<u32>,
}

impl Places {
    /// Of finite positions.
    pub fn of(positions: &[DVec3]) -> Self {
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        order.par_sort_unstable_by(|&a, &b| {
            let [p, q] = [a, b].map(|v| positions[v as usize]);
            let axes = [(p.x, q.x), (p.y, q.y), (p.z, q.z)];
            // Zeros of both signs are one place, as for `==`.
            let apart = axes.into_iter().find_map(|(p, q)| p.partial_cmp(&q).filter(|o| o.is_ne()));
            apart.unwrap_or_else(|| a.cmp(&b))
        });
        Self { order }
    }

    /// The vertices of each place in turn.
    pub fn iter<'a>(&'a self, positions: &'a [DVec3]) -> impl Iterator<Item = &'a [u32]> {
        self.order.chunk_by(|&a, &b| positions[a as usize] == positions[b as usize])
    }
}
