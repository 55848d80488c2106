//! The names that lights are given, and from them and what objects ask for the table of links. Names are numbers here, in order
//! of first use from 1.

use std::collections::{HashMap, HashSet};

use super::requests::Request;
use super::{Label, LinkRequests, LinkRule, Linking};
use crate::scene::{ParamSet, SceneDescription, SceneError, Span, Warnings, undefined};

type Result<T> = std::result::Result<T, Box<SceneError>>;

/// Labels as the lights are built, by their place. What has none costs nothing, except before one that has.
#[derive(Debug, Default)]
pub struct Labels<'a> {
    names: HashMap<&'a str, u32>,
    /// Of each `AreaLightSource`.
    areas: Vec<Label>,
    /// Of each light so far.
    lights: Vec<Label>,
    /// By name, the first exclusive light of that name.
    exclusive: HashMap<u32, Span>,
}

impl<'a> Labels<'a> {
    /// Those of `scene`'s area lights, for lights that are still to come.
    pub fn of_areas(scene: &'a SceneDescription) -> Result<Self> {
        let mut labels = Self::default();
        for directive in &scene.area_lights {
            let label = labels.read(&directive.params)?;
            labels.areas.push(label);
        }
        Ok(labels)
    }

    /// Reads `name` and `exclusive`.
    pub fn read(&mut self, params: &'a ParamSet) -> Result<Label> {
        let is_exclusive = params.bool("exclusive", false)?;
        let name = match params.string("name")?.filter(|name| !name.is_empty()) {
            None => 0,
            Some(name) => {
                let next = self.names.len() as u32 + 1;
                *self.names.entry(name).or_insert(next)
            }
        };
        if is_exclusive {
            self.exclusive.entry(name).or_insert(params.span);
        }
        Ok(Label::new(name, is_exclusive))
    }

    /// The label of the `AreaLightSource` of this number.
    pub fn area(&self, entity: u32) -> Label {
        self.areas[entity as usize]
    }

    /// Gives `label` to the light at `place`, in rising order of places.
    pub fn set(&mut self, place: usize, label: Label) {
        if label != Label::default() {
            self.lights.resize(place, Label::default());
            self.lights.push(label);
        }
    }

    /// The table of links; `None` where no object asks for any and no light is exclusive.
    ///
    /// # Errors
    /// With `strict`, a name that no light has; else that is a warning.
    pub fn link(self, requests: &LinkRequests, strict: bool, warnings: &mut Warnings) -> Result<Option<Linking>> {
        if requests.is_empty() && self.exclusive.is_empty() {
            return Ok(None);
        }
        let mut unknown = HashSet::new();
        let mut rules = vec![];
        for stated in requests.in_order() {
            for (name, span) in stated.names() {
                if self.names.contains_key(name) || !unknown.insert(name) {
                    continue;
                }
                let error = undefined("light", name, span, self.names.keys().copied());
                if strict {
                    return Err(error);
                }
                let help = error.help.as_ref().map_or(String::new(), |help| format!(" ({help})"));
                warnings.add(Some(span), format!("{}: the name is ignored{help}", error.kind));
            }
            rules.push(self.rule(stated.request));
        }
        let linking = Linking::new(self.lights, self.names.len() as u32 + 1, rules);
        let added: HashSet<u32> = linking.sets.iter().flat_map(|rule| rule.lit()).collect();
        let mut idle: Vec<Span> =
            self.exclusive.iter().filter(|(name, _)| !added.contains(name)).map(|(_, &span)| span).collect();
        idle.sort_unstable_by_key(|span| (span.file.0, span.line, span.column));
        if let Some(&first) = idle.first() {
            let more =
                if idle.len() > 1 { format!(" ({} more names like this)", idle.len() - 1) } else { String::new() };
            warnings
                .add(Some(first), format!("this light is exclusive and no object names it: it lights nothing{more}"));
        }
        Ok(Some(linking))
    }

    fn rule(&self, request: &Request) -> LinkRule {
        let numbers = |names: &[String]| -> Vec<u32> {
            names.iter().filter_map(|name| self.names.get(name.as_str()).copied()).collect()
        };
        let only = request.only.as_deref().map(numbers);
        let keeps_rest = only.is_none();
        let lit = only.into_iter().flatten().chain(numbers(&request.added));
        LinkRule::new(lit, numbers(&request.excluded), keeps_rest)
    }
}
