//! The directives that set what others fall back on: `Attribute` and `Option`.

use std::rc::Rc;
use std::sync::Arc;

use super::{Builder, Result, syntax};
use crate::scene::pbrt::directive::did_you_mean;
use crate::scene::pbrt::lexer::TokenKind;
use crate::scene::pbrt::parameter::{self, Context};
use crate::scene::pbrt::state::ATTRIBUTE_TARGETS;
use crate::scene::{LINKS, Param, ParamSet, SceneError, SceneErrorKind};

/// The most defaults that `Attribute` may pile up per target.
const MOST_DEFAULTS: usize = 64;

impl Builder<'_, '_> {
    pub(super) fn attribute(&mut self) -> Result<()> {
        let (target, at) = self.reader.expect_string("what the defaults are for")?;
        let Some(slot) = ATTRIBUTE_TARGETS.iter().position(|t| *t == target) else {
            let what = SceneErrorKind::Parameter(format!("Attribute knows no target \"{target}\""));
            return Err(SceneError::at(at, what).help(did_you_mean(&target, &ATTRIBUTE_TARGETS)));
        };
        let context = Context { color_space: self.state.color_space, base: &self.base };
        let list = parameter::parse_list(&mut self.reader, &context, self.warnings)?;
        let list: Vec<Arc<Param>> = list.into_iter().map(|param| Arc::new(param.into_default())).collect();
        let defaults = Rc::make_mut(&mut self.state.defaults[slot]);
        for param in list {
            match defaults.iter_mut().find(|p| p.name == param.name) {
                Some(earlier) => *earlier = param,
                None => defaults.push(param),
            }
        }
        let is_link = |param: &&Arc<Param>| LINKS.contains(&param.name.as_str());
        if target == "shape" && defaults.iter().any(|param| is_link(&param)) {
            let links = defaults.iter().filter(is_link).cloned().collect();
            self.state.links = Some(Arc::new(ParamSet::of_defaults("Attribute \"shape\"", at, links)));
        }
        if defaults.len() > MOST_DEFAULTS {
            let what =
                SceneErrorKind::Limit(format!("Attribute sets more than {MOST_DEFAULTS} defaults for \"{target}\""));
            return Err(SceneError::at(at, what));
        }
        Ok(())
    }

    /// `Option "type name" value`, or pbrt's `Option "name" value` whose type shows in the value.
    pub(super) fn option(&mut self) -> Result<()> {
        let (declaration, at) = self.reader.expect_string("an option's name")?;
        let typed = if let Some((type_name, name)) = declaration.trim().split_once(|c: char| c.is_ascii_whitespace()) {
            format!("{type_name} {}", normalised(name))
        } else {
            let Some(value) = self.reader.peek()? else {
                return syntax(self.reader.here(), "the file ends where an option's value should follow");
            };
            let text = self.reader.text(&value);
            let type_name = match value.kind {
                TokenKind::Quoted => "string",
                _ if matches!(text, "true" | "false") => "bool",
                _ if text.parse::<i32>().is_ok() => "integer",
                _ => "float",
            };
            format!("{type_name} {}", normalised(&declaration))
        };
        let context = Context { color_space: self.state.color_space, base: &self.base };
        let param = parameter::parse_one(&mut self.reader, &typed, at, &context, self.warnings)?;
        self.header.options.retain(|p| p.name != param.name);
        self.header.options.push(param);
        if self.header.options.len() > MOST_DEFAULTS {
            return Err(SceneError::at(
                at,
                SceneErrorKind::Limit(format!("more than {MOST_DEFAULTS} different options")),
            ));
        }
        Ok(())
    }
}

/// An option's name as pbrt-v4 compares it: in small letters, without hyphens and underscores.
fn normalised(name: &str) -> String {
    name.chars().filter(|c| !matches!(c, '-' | '_')).flat_map(char::to_lowercase).collect()
}
