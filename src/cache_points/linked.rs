//! Light linking at a vertex: unlinked lights are dropped, exclusive ones added. Source: Li et al. 2024, section 3.3, step 3.
//!
//! Only objects that state which lights light them come here.

use super::CachePoints;
use crate::light::{LightId, Lights, LinkSet, Receiver};

/// Lights evaluated at a vertex because its object names them.
#[derive(Clone, Debug, Default)]
pub struct Named {
    /// Which, in order.
    pub lights: Vec<LightId>,
    /// Running sums of their weights.
    pub sums: Vec<f64>,
}

impl Named {
    /// None of them.
    pub fn clear(&mut self) {
        self.lights.clear();
        self.sums.clear();
    }

    /// Sum of all weights.
    pub fn total(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }
}

impl CachePoints {
    /// Finds the lights that `links` adds for `receiver`, and drops those that it leaves out from the `weights` of a point's entries. A cluster
    /// stays as long as it is not one light: a dropped light that is drawn from it is refused then.
    pub(super) fn link(
        &self,
        lights: &Lights,
        (point, receiver): (u32, &Receiver),
        links: LinkSet,
        weights: &mut [f32],
        named: &mut Named,
    ) {
        let Some(linking) = lights.linking() else { return };
        let keeps_rest = linking.keeps_rest(links);
        if keeps_rest {
            named.lights.extend(linking.extra(links));
            for (weight, cluster) in weights.iter_mut().zip(self.table.list(point).iter()) {
                if self.hierarchy.light(&cluster).is_some_and(|id| !lights.is_linked(links, id)) {
                    *weight = 0.0;
                }
            }
        } else {
            named.lights.extend(linking.named(links));
            weights.fill(0.0);
        }
        named.lights.sort_unstable();
        named.lights.dedup();
        let mut sum = 0.0;
        named.sums.extend(named.lights.iter().map(|&id| {
            sum += f64::from(lights.contribution(id, receiver));
            sum
        }));
    }
}
