//! Light linking at a vertex: unlinked lights are dropped, exclusive ones added. Source: Li et al. 2024, section 3.3, step 3.
//!
//! Only objects that state which lights light them come here; they pay for a pass over the point's entries.

use super::CachePoints;
use super::select::CacheScratch;
use super::table::range;
use crate::light::{LightId, Lights, LinkSet, Receiver};

/// What linking changes at one vertex.
#[derive(Clone, Debug, Default)]
pub struct Linked {
    /// Lights evaluated at the vertex because its object names them, in order.
    pub named: Vec<LightId>,
    /// Running sums of their weights.
    pub named_sums: Vec<f64>,
    /// Running sums over the point's far entries, all sensors together, where some are dropped.
    pub far_sums: Vec<f64>,
    /// Whether the point's own lists light the object at all.
    pub keeps_rest: bool,
    /// Whether `far_sums` stands in for the sensors' own sums.
    pub drops: bool,
}

impl Linked {
    /// What holds for objects that state nothing.
    pub fn reset(&mut self) {
        self.named.clear();
        self.named_sums.clear();
        self.far_sums.clear();
        (self.keeps_rest, self.drops) = (true, false);
    }
}

impl CachePoints {
    /// Finds the lights that `links` adds or leaves alone.
    pub(super) fn find_linked(lights: &Lights, receiver: &Receiver, links: LinkSet, linked: &mut Linked) {
        let Some(linking) = lights.linking() else { return };
        linked.keeps_rest = linking.keeps_rest(links);
        if linked.keeps_rest {
            linked.named.extend(linking.extra(links));
            linked.drops = linking.excluded(links).next().is_some();
        } else {
            linked.named.extend(linking.named(links));
        }
        linked.named.sort_unstable();
        linked.named.dedup();
        let mut sum = 0.0;
        linked.named_sums.extend(linked.named.iter().map(|&id| {
            sum += f64::from(lights.contribution(id, receiver));
            sum
        }));
    }

    /// Sums up the point's far entries without the lights that `links` drops. A cluster stays as long as it is not one light: a dropped
    /// light that is drawn from it is refused then.
    pub(super) fn sum_linked_far(&self, lights: &Lights, point: u32, links: LinkSet, scratch: &mut CacheScratch) {
        let CacheScratch { linked, bins, .. } = scratch;
        let entries = range(&self.far.offsets, point);
        linked.far_sums.resize(entries.len(), 0.0);
        for &(bin, weight, _) in bins.iter() {
            let mut before = 0.0;
            for (sum, &running) in linked.far_sums.iter_mut().zip(self.far.sums_of(point, bin)) {
                *sum += weight * f64::from(running - before);
                before = running;
            }
        }
        let mut sum = 0.0;
        for (entry, cluster) in linked.far_sums.iter_mut().zip(&self.far.clusters[entries]) {
            let is_lit = self.hierarchy.light(cluster).is_none_or(|id| lights.is_linked(links, id));
            sum += if is_lit { *entry } else { 0.0 };
            *entry = sum;
        }
    }
}
