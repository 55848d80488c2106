//! A scene made ready to render: film, camera, world, cache points and the choice of lights, each built only where the scene and the settings ask for it.

use std::time::Instant;

use super::lesson::{Lesson, LessonError, first_untaken};
use super::plan::Plan;
use super::{Job, RenderError, RenderSettings, SamplerKind, Share, Timings, ViewRays, build, may_take, memory};
use crate::cache_points::CachePoints;
use crate::film::{Film, FilmSettings};
use crate::geometry::Backend;
use crate::geometry::camera::Camera;
use crate::integrator::PathSettings;
use crate::integrator::in_scatter::equi_angular::EquiAngular;
use crate::integrator::path::MOST_BOUNCES;
use crate::scene::{Entity, Param, ParamSet, SceneDescription, SceneError, Warnings};
use crate::system::taken;

impl Job {
    /// Builds everything that rendering `scene` takes. Must run inside the pool that will render.
    pub fn prepare(
        scene: &SceneDescription,
        settings: &RenderSettings,
        timings: Timings,
        warnings: &mut Warnings,
    ) -> Result<Self, RenderError> {
        Self::prepare_taught(scene, settings, timings, warnings, None)
    }

    /// The same with what another render of the scene has learned, in [`RenderSettings::load_cache`].
    ///
    /// # Errors
    /// Also what was learned of other lights, or from samples that this render takes.
    pub fn prepare_taught(
        scene: &SceneDescription,
        settings: &RenderSettings,
        mut timings: Timings,
        warnings: &mut Warnings,
        lesson: Option<Lesson>,
    ) -> Result<Self, RenderError> {
        // What the text is at fault in, before anything is built.
        if settings.strict {
            warnings.refuse_faults()?;
        }
        let film = FilmSettings::build(scene, &settings.film, warnings)?;
        let space = crate::math::transform::RenderSpace { origin: scene.camera_position() };
        let camera = Camera::build(scene, &film, &space, warnings)?;
        memory::check_film(scene, &film)?;
        let stated_depth = at_least(&scene.integrator, "maxdepth", 5, 0)?;
        let max_depth = settings.max_depth.unwrap_or(stated_depth).min(MOST_BOUNCES);
        let scene_spp = samples_per_pixel(scene)?;
        let scene_seed = seed_of(scene)?;
        let seed = settings.seed(scene_seed);
        let mut lesson = lesson;
        let taught_by = lesson.as_mut().map_or_else(Vec::new, |lesson| std::mem::take(&mut lesson.taken));
        // Parts leave to the frame's own lesson what it has taken; any other has to have taken other samples.
        let is_of_frame = lesson.as_ref().is_some_and(|lesson| lesson.is_of_frame);
        let taught = if is_of_frame { first_untaken(&taught_by, seed) } else { 0 };
        let (first_sample, budget) = settings.share.of(settings.budget, scene_spp, film.bounds.area(), taught)?;
        warn_about_engine(scene, warnings)?;
        settings.warn_ignored(warnings);
        let backend = settings.backend.unwrap_or(Backend::DEFAULT);
        let mut world = build::build_world(scene, settings, &film, backend, &mut timings, warnings)?;
        if settings.strict {
            warnings.refuse_faults()?;
        }
        // Again, now that everything else is in memory.
        memory::check_film(scene, &film)?;
        let path_of_lesson = || settings.load_cache.clone().unwrap_or_default();
        let own = may_take(seed, first_sample, budget);
        if let Some(&taken) = taught_by.iter().find(|taken| taken.overlaps(&own)) {
            return Err(LessonError::Overlap { path: path_of_lesson(), taken }.into());
        }
        let finest = scene.options.bool("disabletexturefiltering", false)?;
        let texture_share = settings.texture_share(scene_spp).filter(|_| world.materials.has_levels() && !finest);
        let mut path = PathSettings { max_depth, light_candidates: 1, tries: 1 };
        let choice = build::ChoicePlan::of(&world.lights, &world.media, settings);
        if settings.plan_only {
            if choice.selector.is_some() {
                let choice = build::ChoicePlan { in_scatter: false, ..choice };
                build::choose_lights(&mut world, &choice, None, settings, warnings);
            }
        } else {
            taken::begin("cache points");
            let start = Instant::now();
            let builder = build::CacheBuilder {
                camera: &camera,
                film: &film,
                path: &path,
                seed,
                settings: memory::for_cache_points(settings.cache),
                texture_share,
                on_camera_rays: choice.in_scatter && choice.selector.is_some(),
            };
            if builder.on_camera_rays {
                world.equi_angular = Some(EquiAngular::new(&world.lights, world.extent));
            }
            let kept = lesson.as_mut().and_then(|lesson| lesson.points.take());
            let points = match kept.filter(|_| choice.has_points()) {
                Some(kept) => {
                    let points = CachePoints::from_kept(&world.lights, kept, settings.cache);
                    let unfit = || LessonError::Unreadable {
                        path: path_of_lesson(),
                        reason: "it does not fit the lights of this scene".to_owned(),
                    };
                    Some(points.ok_or_else(unfit)?)
                }
                None if choice.has_points() => builder.build(&world),
                None => None,
            };
            if let Some(points) = &points {
                memory::warn_few_candidates(points.statistics(), settings.cache, warnings);
            }
            let are_new = points.as_ref().is_some_and(|points| !points.statistics().are_loaded);
            build::choose_lights(&mut world, &choice, points, settings, warnings);
            if are_new {
                builder.rehearse(&mut world);
            }
            timings.cache_points = start.elapsed().as_secs_f64();
        }
        taken::begin("film");
        path.light_candidates =
            settings.light_candidates.unwrap_or_else(|| build::light_candidates(&world.light_choice, settings.lights));
        let is_known = world.equi_angular.is_some() || world.light_choice.cache_points().is_some();
        let draws = choice.in_scatter && (settings.plan_only || is_known);
        let in_scatter = draws.then_some(settings.volume_sampling);
        let is_independent = match settings.sampler {
            SamplerKind::Scene => scene.sampler.kind == "independent",
            SamplerKind::Sobol => false,
            SamplerKind::Independent => true,
        };
        let splits_views = settings.view_rays == ViewRays::Auto && world.shines();
        let plan = Plan::of(&world, &camera, draws, splits_views, &film);
        let mut job = Self {
            world,
            camera,
            origin: space.origin,
            film,
            aovs: true,
            path,
            in_scatter,
            splits_views,
            is_independent,
            texture_share,
            plan,
            timings,
            scene_spp,
            first_sample,
            budget,
            scene_seed,
            seed,
            teaches: settings.save_cache.is_some(),
            is_lesson: matches!(settings.share, Share::Lesson { .. }),
            is_frozen: settings.freeze_cache,
            taught_by,
            taught: None,
            backend,
        };
        if let Some(Lesson { mixing, splitting, .. }) = lesson {
            let mut guides = job.guides(&Film::new(job.film.clone(), false));
            // Those of an image of another size are of no use.
            if guides.restore(mixing, splitting) {
                job.taught = Some(guides);
            }
        }
        Ok(job)
    }
}

/// The seed that the scene's sampler or its options ask for.
///
/// # Errors
/// Seeds that are no integers.
pub fn seed_of(scene: &SceneDescription) -> Result<u32, Box<SceneError>> {
    Ok(scene.sampler.params.integer("seed", scene.options.integer("seed", 0)?)? as u32)
}

/// The integer parameter `name` of `entity`, which must not be below `least`.
fn at_least(entity: &Entity, name: &str, default: i32, least: i32) -> Result<u32, Box<SceneError>> {
    let value = entity.params.integer(name, default)?;
    if value < least {
        return Err(entity.params.wrong(name, &format!("at least {least}, found {value}")));
    }
    Ok(value as u32)
}

/// Samples a pixel that the scene's `Sampler` asks for, with the defaults of pbrt-v4's samplers.
fn samples_per_pixel(scene: &SceneDescription) -> Result<u32, Box<SceneError>> {
    let sampler = &scene.sampler;
    if sampler.kind != "stratified" {
        return at_least(sampler, "pixelsamples", 16, 1);
    }
    let (x, y) = (at_least(sampler, "xsamples", 4, 1)?, at_least(sampler, "ysamples", 4, 1)?);
    sampler.params.get("jitter");
    x.checked_mul(y).ok_or_else(|| sampler.params.wrong("xsamples", "such that xsamples × ysamples is below 2^32"))
}

/// pbrt-v4's samplers.
const SAMPLERS: [&str; 8] = ["", "halton", "independent", "paddedsobol", "pmj02bn", "sobol", "stratified", "zsobol"];

/// Says of pbrt-v4's options what is not done; of those that change no image, nothing.
fn options(options: &ParamSet, warnings: &mut Warnings) -> Result<(), Box<SceneError>> {
    for name in [
        "displacementedgescale",
        "disabletexturefiltering",
        "disablewavelengthjitter",
        "pixelstats",
        "rendercoordsys",
        "wavefront",
    ] {
        options.get(name);
    }
    for (name, why) in [
        ("disablepixeljitter", "samples are spread over their pixels"),
        ("forcediffuse", "materials are what they are"),
    ] {
        if options.bool(name, false)? {
            options.warn_ignored(name, why, warnings);
        }
    }
    for name in ["msereferenceimage", "msereferenceout"] {
        options.warn_ignored(name, "`lanternfish compare` measures errors", warnings);
    }
    options.warn_unused(warnings);
    Ok(())
}

fn warn_about_engine(scene: &SceneDescription, warnings: &mut Warnings) -> Result<(), Box<SceneError>> {
    let kind = scene.integrator.kind.as_str();
    let params = &scene.integrator.params;
    if !matches!(kind, "" | "volpath" | "path") {
        let message = format!("integrator \"{kind}\" is not here; the volumetric path tracer renders instead");
        warnings.add(Some(scene.integrator.span()), message);
        // Said in one line.
        params.iter().for_each(Param::mark_used);
    }
    let sampler = scene.sampler.kind.as_str();
    if !SAMPLERS.contains(&sampler) {
        let message = format!("sampler \"{sampler}\" is not known; points are Owen-scrambled Sobol' points");
        warnings.add(Some(scene.sampler.span()), message);
    }
    // What pbrt-v4 takes and what has no use here: `--lights` chooses how lights are selected, paths are never regularised (that would bias the image),
    // and points are Owen-scrambled Sobol' points.
    for name in ["lightsampler", "regularize"] {
        params.get(name);
    }
    scene.sampler.params.get("randomization");
    options(&scene.options, warnings)?;
    params.warn_unused(warnings);
    scene.sampler.params.warn_unused(warnings);
    Ok(())
}
