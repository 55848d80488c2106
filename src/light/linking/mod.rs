//! Light linking: which lights light which objects. Every object has a [`LinkSet`], and those that state the same share one, so that a
//! million shapes cost a number each.
//!
//! The rule, in this order: what a set excludes by name does not light it; what it names besides does, exclusive or not; of all others
//! the lights that are not exclusive do, unless the set is of named lights *only*.
//!
//! Sets know names, not lights: a light has one name (several lights of one name are a group), a set lists the names that it treats apart.
//! So memory is lights + names in sets, never lights × sets. Linking is about light that comes straight from a light and is
//! scattered at the object, by whatever technique it is found; cameras see every light, and objects cast shadows from all of them.

pub mod labels;
pub mod requests;

use super::LightId;

pub use requests::LinkRequests;

/// The lights that light an object, by their place in [`Linking`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct LinkSet(pub u32);

impl LinkSet {
    /// All lights that are not exclusive: the set of objects that state nothing.
    pub const ORDINARY: Self = Self(0);
}

/// A light's name (0 for none) and whether it is exclusive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Label(u32);

impl Label {
    /// The label of a light with the name number `name`, below 2³¹.
    pub fn new(name: u32, is_exclusive: bool) -> Self {
        Self(name << 1 | u32::from(is_exclusive))
    }

    #[inline]
    fn name(self) -> u32 {
        self.0 >> 1
    }

    #[inline]
    fn is_exclusive(self) -> bool {
        self.0 & 1 != 0
    }
}

/// What one set says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkRule {
    /// The names treated apart, in rising order, each with its verdict: name · 2 + (1 if its lights light the set).
    listed: Box<[u32]>,
    /// Lights that are not named here and not exclusive light the set.
    keeps_rest: bool,
}

impl LinkRule {
    /// The lights of the names `lit`, with `keeps_rest` all ordinary ones too, but none of the names `excluded`.
    pub fn new(lit: impl IntoIterator<Item = u32>, excluded: impl IntoIterator<Item = u32>, keeps_rest: bool) -> Self {
        let lit = lit.into_iter().map(|name| name << 1 | 1);
        let mut listed: Vec<u32> = lit.chain(excluded.into_iter().map(|name| name << 1)).collect();
        // Of one name both ways the exclusion comes first and stays.
        listed.sort_unstable();
        listed.dedup_by_key(|entry| *entry >> 1);
        Self { listed: listed.into(), keeps_rest }
    }

    /// The names that light the set.
    fn lit(&self) -> impl Iterator<Item = u32> {
        self.listed.iter().filter(|&entry| entry & 1 != 0).map(|entry| entry >> 1)
    }

    #[inline]
    fn links(&self, label: Label) -> bool {
        match self.listed.binary_search_by_key(&label.name(), |entry| entry >> 1) {
            Ok(place) => self.listed[place] & 1 != 0,
            Err(_) => self.keeps_rest && !label.is_exclusive(),
        }
    }
}

/// All sets of a scene, and the names of its lights.
#[derive(Debug)]
pub struct Linking {
    /// By light; the lights after the last of them have no name and are not exclusive.
    labels: Box<[Label]>,
    sets: Box<[LinkRule]>,
    /// Where each name's lights begin in `members`, and where the last one's end.
    starts: Box<[u32]>,
    /// The lights of each name in turn; those of none are left out.
    members: Box<[LightId]>,
    exclusive: u32,
}

impl Linking {
    /// Of the lights' labels, whose names are below `names`, and the rules of all sets but [`LinkSet::ORDINARY`].
    pub fn new(labels: Vec<Label>, names: u32, rules: impl IntoIterator<Item = LinkRule>) -> Self {
        let mut starts = vec![0u32; names as usize + 1];
        let mut exclusive = 0;
        for label in &labels {
            exclusive += u32::from(label.is_exclusive());
            if label.name() > 0 {
                starts[label.name() as usize + 1] += 1;
            }
        }
        for name in 1..starts.len() {
            starts[name] += starts[name - 1];
        }
        let mut next = starts.clone();
        let mut members = vec![LightId(0); starts.last().map_or(0, |&end| end as usize)];
        for (light, label) in labels.iter().enumerate().filter(|(_, label)| label.name() > 0) {
            let place = &mut next[label.name() as usize];
            members[*place as usize] = LightId(light as u32);
            *place += 1;
        }
        let sets = std::iter::once(LinkRule::new([], [], true)).chain(rules).collect();
        Self { labels: labels.into(), sets, starts: starts.into(), members: members.into(), exclusive }
    }

    #[inline]
    fn label(&self, id: LightId) -> Label {
        self.labels.get(id.0 as usize).copied().unwrap_or_default()
    }

    #[inline]
    fn rule(&self, set: LinkSet) -> &LinkRule {
        &self.sets[set.0 as usize]
    }

    /// Whether the light `id` lights the objects of `set`.
    #[inline]
    pub fn is_linked(&self, set: LinkSet, id: LightId) -> bool {
        self.rule(set).links(self.label(id))
    }

    /// Whether the light `id` lights only objects that name it.
    #[inline]
    pub fn is_exclusive(&self, id: LightId) -> bool {
        self.label(id).is_exclusive()
    }

    /// Whether the lights that `set` does not name light it, exclusive ones apart. If not, [`Linking::named`] are all that do.
    #[inline]
    pub fn keeps_rest(&self, set: LinkSet) -> bool {
        self.rule(set).keeps_rest
    }

    /// The lights that light `set` because it names them: name by name, those of a name in order.
    pub fn named(&self, set: LinkSet) -> impl Iterator<Item = LightId> {
        self.listed(set, 1)
    }

    /// The exclusive lights that `set` adds to those that light everything.
    pub fn extra(&self, set: LinkSet) -> impl Iterator<Item = LightId> {
        self.named(set).filter(|&id| self.is_exclusive(id))
    }

    /// The lights that `set` would have by being ordinary and excludes by name. Where it does not keep the rest, that is out besides.
    pub fn excluded(&self, set: LinkSet) -> impl Iterator<Item = LightId> {
        self.listed(set, 0).filter(|&id| !self.is_exclusive(id))
    }

    fn listed(&self, set: LinkSet, verdict: u32) -> impl Iterator<Item = LightId> {
        let entries = self.rule(set).listed.iter().filter(move |&entry| entry & 1 == verdict);
        entries.flat_map(move |entry| {
            let name = (entry >> 1) as usize;
            self.members[self.starts[name] as usize..self.starts[name + 1] as usize].iter().copied()
        })
    }

    /// Sets to 0 the weights (of all lights, in order) of those that do not light `set`.
    pub fn clear_unlinked(&self, set: LinkSet, weights: &mut [f32]) {
        if set == LinkSet::ORDINARY && self.exclusive == 0 {
            return;
        }
        let rule = self.rule(set);
        let (labelled, plain) = weights.split_at_mut(self.labels.len().min(weights.len()));
        for (weight, &label) in labelled.iter_mut().zip(&self.labels) {
            if !rule.links(label) {
                *weight = 0.0;
            }
        }
        if !rule.keeps_rest {
            plain.fill(0.0);
        }
    }

    /// How many sets there are, that of objects which state nothing included.
    pub fn set_count(&self) -> usize {
        self.sets.len()
    }

    /// How many lights have a name.
    pub fn named_count(&self) -> usize {
        self.members.len()
    }

    /// How many lights are exclusive.
    pub fn exclusive_count(&self) -> usize {
        self.exclusive as usize
    }

    /// Bytes held on the heap.
    pub fn memory(&self) -> usize {
        let listed: usize = self.sets.iter().map(|rule| size_of_val(&*rule.listed)).sum();
        size_of_val(&*self.labels)
            + size_of_val(&*self.sets)
            + listed
            + size_of_val(&*self.starts)
            + size_of_val(&*self.members)
    }
}
