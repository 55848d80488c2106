//! What objects ask for: the parameters `lights`, `excludelights` and `addlights` of shapes and media. They are read before there are
//! lights; objects that ask for the same get the same [`LinkSet`].

use std::collections::HashMap;

use super::LinkSet;
use crate::scene::{LINKS, ParamSet, SceneError, Span};

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// The names of lights in an object's parameters, each list sorted, without repetitions.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Request {
    /// `lights`: only these, if given.
    pub only: Option<Box<[String]>>,
    /// `excludelights`.
    pub excluded: Box<[String]>,
    /// `addlights`.
    pub added: Box<[String]>,
}

/// A request with the place of each of its lists, where it was first stated.
#[derive(Clone, Copy, Debug)]
pub struct Stated<'a> {
    /// The request.
    pub request: &'a Request,
    spans: [Span; 3],
}

impl<'a> Stated<'a> {
    /// Every name with the place of its list.
    pub fn names(self) -> impl Iterator<Item = (&'a str, Span)> {
        let Request { only, excluded, added } = self.request;
        let lists = [only.as_deref().unwrap_or_default(), excluded, added];
        let spans = self.spans;
        lists.into_iter().zip(spans).flat_map(|(list, span)| list.iter().map(move |name| (name.as_str(), span)))
    }
}

/// All different requests of a scene.
#[derive(Clone, Debug, Default)]
pub struct LinkRequests {
    numbers: HashMap<Request, (LinkSet, [Span; 3])>,
}

impl LinkRequests {
    /// The set of an object with these parameters; marks them used.
    ///
    /// # Errors
    /// Parameters of a wrong type.
    pub fn add(&mut self, params: &ParamSet) -> Result<LinkSet> {
        let [only, excluded, added] = LINKS.map(|name| params.get(name));
        let spans = [only, excluded, added].map(|param| param.map_or(params.span, |param| param.span));
        let sorted = |name: &str| -> Result<Box<[String]>> {
            let mut names = params.strings(name)?.to_vec();
            names.sort_unstable();
            names.dedup();
            Ok(names.into())
        };
        let request = Request {
            only: only.map(|_| sorted("lights")).transpose()?,
            excluded: sorted("excludelights")?,
            added: sorted("addlights")?,
        };
        if request == Request::default() {
            return Ok(LinkSet::ORDINARY);
        }
        let next = LinkSet(self.numbers.len() as u32 + 1);
        Ok(self.numbers.entry(request).or_insert((next, spans)).0)
    }

    /// Whether no object asks for anything.
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    /// The requests in the order of their sets, from 1.
    pub fn in_order(&self) -> Vec<Stated<'_>> {
        let mut list: Vec<_> = self.numbers.iter().collect();
        list.sort_unstable_by_key(|(_, (set, _))| set.0);
        list.into_iter().map(|(request, &(_, spans))| Stated { request, spans }).collect()
    }
}
