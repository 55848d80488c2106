//! The directives that add something to the scene by name or by place: materials, media, textures, objects and shapes.

use std::sync::Arc;

use super::{BY_NAME, Builder, Opened, PARAMETERS, Result, store, syntax};
use crate::scene::pbrt::directive::did_you_mean;
use crate::scene::pbrt::lexer::TokenKind;
use crate::scene::pbrt::older::UPGRADE;
use crate::scene::pbrt::state::CurrentMaterial;
use crate::scene::{
    Entity, InstanceEntity, MaterialEntity, MaterialIndex, MediumEntity, MediumInterface, ObjectEntity, ParamSet,
    SceneError, SceneErrorKind, ShapeEntity, Span, TextureEntity,
};

/// Objects within objects: they are flattened by recursion.
const DEEPEST_OBJECT: u32 = 64;

impl Builder<'_, '_> {
    pub(super) fn make_named_material(&mut self, span: Span) -> Result<()> {
        let (name, at) = self.reader.expect_string("a material's name")?;
        let params = self.params(&format!("MakeNamedMaterial \"{name}\""), span, Some("material"))?;
        let kind = required_type(&params, at)?;
        self.notice_age("Material", &kind, span);
        if self.material_names.insert(name.clone(), self.scene.materials.len() as u32).is_some() {
            return redefined(at, "material", &name);
        }
        let entity = Entity { kind: self.reader.name(&kind), params };
        store(&mut self.scene.materials, MaterialEntity { name: Some(name), entity }, PARAMETERS, span)
    }

    pub(super) fn make_named_medium(&mut self, span: Span) -> Result<()> {
        let (name, at) = self.reader.expect_string("a medium's name")?;
        let params = self.params(&format!("MakeNamedMedium \"{name}\""), span, Some("medium"))?;
        let kind = required_type(&params, at)?;
        self.notice_age("MakeNamedMedium", &kind, span);
        if self.medium_names.insert(name.clone(), self.scene.media.len() as u32).is_some() {
            return redefined(at, "medium", &name);
        }
        let transform = *self.state.ctm.animated();
        self.scene.media.push(MediumEntity {
            name,
            entity: Entity { kind: self.reader.name(&kind), params },
            transform,
        });
        Ok(())
    }

    pub(super) fn medium_interface(&mut self) -> Result<()> {
        let (inside, inside_at) = self.reader.expect_string("a medium's name")?;
        let second = self.reader.peek()?.filter(|t| t.kind == TokenKind::Quoted);
        let (outside, outside_at) = match second {
            Some(_) => self.reader.expect_string("a medium's name")?,
            None => (inside.clone(), inside_at),
        };
        for (name, at) in [(&inside, inside_at), (&outside, outside_at)] {
            if !name.is_empty() {
                self.medium_references.add(name, at);
            }
        }
        self.state.medium_interface = Some(Arc::new(MediumInterface { inside, outside }));
        Ok(())
    }

    pub(super) fn object_begin(&mut self, span: Span) -> Result<()> {
        let (name, at) = self.reader.expect_string("an object's name")?;
        if let Some(open) = &self.object {
            let message =
                format!("object definitions cannot nest: \"{}\" of line {} is open", open.name, open.span.line);
            return syntax(span, message);
        }
        if self.object_names.contains_key(&name) {
            return redefined(at, "object", &name);
        }
        self.push(Opened::Object, span)?;
        self.object = Some(ObjectEntity {
            name,
            span,
            shapes: Vec::new(),
            instances: Vec::new(),
            links: self.state.links.clone(),
        });
        self.object_depth = 0;
        Ok(())
    }

    pub(super) fn object_end(&mut self, span: Span) -> Result<()> {
        self.pop(Opened::Object, span)?;
        if let Some(object) = self.object.take() {
            self.object_names.insert(object.name.clone(), self.scene.objects.len() as u32);
            self.scene.objects.push(object);
            self.object_depths.push(self.object_depth);
        }
        Ok(())
    }

    pub(super) fn object_instance(&mut self, span: Span) -> Result<()> {
        let (name, at) = self.reader.expect_string("an object's name")?;
        let object = match self.object_names.get(&name) {
            Some(&object) => object,
            // As for named materials, the definition may follow. Not within an object: there it could come to hold itself.
            None if self.object.is_none() => self.object_references.add(&name, at) | BY_NAME,
            None => {
                let known: Vec<&str> = self.object_names.keys().map(String::as_str).take(256).collect();
                let what = SceneErrorKind::Undefined(format!("no object called \"{name}\" is defined above"));
                let error = SceneError::at(at, what);
                return Err(if known.is_empty() { error } else { error.help(did_you_mean(&name, &known)) });
            }
        };
        let instance =
            InstanceEntity { object, transform: self.state.ctm.animated(), links: self.state.links.clone(), span };
        let Some(outer) = &mut self.object else {
            return store(&mut self.scene.instances, instance, 0, span);
        };
        self.object_depth = self.object_depth.max(self.object_depths[object as usize] + 1);
        if self.object_depth > DEEPEST_OBJECT {
            let what = SceneErrorKind::Limit(format!("more than {DEEPEST_OBJECT} objects within each other"));
            return Err(SceneError::at(span, what));
        }
        store(&mut outer.instances, instance, 0, span)
    }

    pub(super) fn shape(&mut self, span: Span) -> Result<()> {
        let entity = self.entity("Shape", span, Some("shape"))?;
        let material = MaterialIndex(match self.state.material {
            CurrentMaterial::Index(index) => index,
            CurrentMaterial::Named(name) => name | BY_NAME,
        });
        let mut area_light = None;
        if let Some(index) = self.state.area_light {
            let (pending, place) = &mut self.area_lights[index as usize];
            if self.object.is_some() {
                // Said once per light: an object may hold a great many shapes.
                if let Some(entity) = pending.take() {
                    let message = "area lights inside object definitions are ignored (as in pbrt-v4): this one emits nothing there";
                    self.warnings.add(Some(entity.span()), message);
                    *pending = Some(entity);
                }
            } else {
                if let Some(entity) = pending.take() {
                    *place = self.scene.area_lights.len() as u32;
                    self.scene.area_lights.push(entity);
                }
                area_light = Some(*place);
            }
        }
        let shape = ShapeEntity {
            entity,
            transform: self.state.ctm.animated(),
            reverse_orientation: self.state.reverse_orientation,
            material,
            area_light,
            medium_interface: self.state.medium_interface.clone(),
        };
        let list = self.object.as_mut().map_or(&mut self.scene.shapes, |object| &mut object.shapes);
        store(list, shape, PARAMETERS, span)
    }

    pub(super) fn texture(&mut self, span: Span) -> Result<()> {
        let (name, at) = self.reader.expect_string("a texture's name")?;
        let (type_name, type_at) = self.reader.expect_string("\"float\" or \"spectrum\"")?;
        let is_spectrum = match type_name.as_str() {
            "float" => false,
            "spectrum" => true,
            _ => {
                let what =
                    SceneErrorKind::Parameter(format!("a texture's type is float or spectrum, found \"{type_name}\""));
                return Err(
                    SceneError::at(type_at, what).help(format!("older files say color: write spectrum; {UPGRADE}"))
                );
            }
        };
        let (kind, _) = self.reader.expect_string("a texture's class")?;
        self.notice_age("Texture", &kind, span);
        let params = self.params(&format!("Texture \"{name}\" \"{kind}\""), span, Some("texture"))?;
        if self.texture_names.insert((name.clone(), is_spectrum), self.scene.textures.len() as u32).is_some() {
            return redefined(at, &format!("{type_name} texture"), &name);
        }
        let transform = *self.state.ctm.animated();
        self.scene.textures.push(TextureEntity {
            name,
            is_spectrum,
            entity: Entity { kind: self.reader.name(&kind), params },
            transform,
        });
        Ok(())
    }
}

fn redefined(span: Span, what: &str, name: &str) -> Result<()> {
    let kind = SceneErrorKind::Parameter(format!("the {what} \"{name}\" is defined a second time"));
    Err(SceneError::at(span, kind).help("give it another name"))
}

/// The `"string type"` of a named material or medium.
fn required_type(params: &ParamSet, span: Span) -> Result<String> {
    match params.string("type")? {
        Some(kind) => Ok(kind.to_owned()),
        None => {
            let what = SceneErrorKind::Parameter(format!("{} lacks its type", params.owner));
            Err(SceneError::at(span, what).help("add a parameter like \"string type\" \"diffuse\""))
        }
    }
}
