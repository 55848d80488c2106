//! A job template of Open Job Description, for AWS Deadline Cloud and whatever else reads it: a step for the lesson of each frame, a step that renders, with a task for each part of each
//! frame, and a step that merges. After the specification `jobtemplate-2023-09` (github.com/OpenJobDescription/openjd-specifications,
//! "2023-09-Template-Schemas"); section names below are its own.
//!
//! Names and options are parameters, so that one template serves other scenes too. They reach the scripts as arguments and are never
//! part of their text: no name can break a script.

use serde::Serialize;
use serde_json::{Value, json};

use super::{FarmError, FarmJob, NUMBERED};

/// Time that a render has to keep a checkpoint when it is told to stop, in seconds; 600 is the most that may be asked for
/// (`CancelationMethodNotifyThenTerminate`).
const NOTICE: u32 = 300;

/// The most characters that the value of a parameter may have (`JobStringParameterDefinition`).
const LONGEST: usize = 1024;

/// The names of the files of a job bundle.
pub const TEMPLATE: &str = "template.json";
/// The same.
pub const VALUES: &str = "parameter_values.json";

/// Names and values of parameters.
pub type Values = Vec<(&'static str, String)>;

/// A `JobTemplate`.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Template {
    specification_version: &'static str,
    name: String,
    description: String,
    parameter_definitions: Vec<Definition>,
    steps: Vec<Step>,
}

/// A `JobParameterDefinition`.
#[derive(Clone, Debug, Default, Serialize)]
#[serde(rename_all = "camelCase")]
struct Definition {
    name: &'static str,
    r#type: &'static str,
    description: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    object_type: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    data_flow: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    min_value: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    default: Option<Value>,
}

/// A `StepTemplate`.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct Step {
    name: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    dependencies: Option<Value>,
    host_requirements: Value,
    #[serde(skip_serializing_if = "Option::is_none")]
    parameter_space: Option<Value>,
    script: Script,
}

/// A `StepScript`.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct Script {
    actions: Value,
    embedded_files: Value,
}

/// The template, and values of its parameters in the order in which it has them.
///
/// # Errors
/// Where a value is longer than the specification allows.
pub fn template(job: &FarmJob) -> Result<(Template, Values), FarmError> {
    let path = |name, description, data_flow| Definition {
        name,
        r#type: "PATH",
        description,
        object_type: Some("FILE"),
        data_flow: Some(data_flow),
        ..Definition::default()
    };
    let string = |name, description, default: String| Definition {
        name,
        r#type: "STRING",
        description,
        default: Some(default.into()),
        ..Definition::default()
    };
    let options =
        shlex::try_join(job.options.iter().map(String::as_str)).map_err(|_| FarmError::Word(job.options.join(" ")))?;
    let mut parameters = vec![
        path("Scene", "The scene, pbrt-v4 text; #### is the number of the frame.", "IN"),
        path("Output", "The OpenEXR file to write; #### is the number of the frame.", "OUT"),
        Definition {
            name: "Parts",
            r#type: "INT",
            description: "Into how many tasks a frame is divided.",
            min_value: Some(1),
            default: Some(job.parts.into()),
            ..Definition::default()
        },
        string("RenderOptions", "Further options of lanternfish render, as a shell reads them.", options.clone()),
        string("Program", "The program lanternfish.", job.program.clone()),
    ];
    // Paths have no defaults: those would have to be relative to the template.
    let mut values = vec![
        ("Scene", job.scene.clone()),
        ("Output", job.output.clone()),
        ("Parts", job.parts.to_string()),
        ("RenderOptions", options),
        ("Program", job.program.clone()),
    ];
    if let Some(frames) = &job.frames {
        let range = format!("{}-{}", frames.start(), frames.end());
        parameters.insert(
            2,
            string("Frames", "The frames: A-B, or A-B:STEP, or several of these with commas between.", range.clone()),
        );
        values.insert(2, ("Frames", range));
    }
    if let Some(png) = &job.png {
        let what = "The PNG to write of each merged image; #### is the number of the frame.";
        parameters.push(path("Png", what, "OUT"));
        values.push(("Png", png.clone()));
    }
    if let Some((name, value)) = values.iter().find(|(_, value)| value.chars().count() > LONGEST) {
        return Err(FarmError::Long(name, value.chars().count()));
    }
    let template = Template {
        specification_version: "jobtemplate-2023-09",
        name: title(&job.label()),
        description:
            "Renders with Lanternfish: every frame in parts, which are merged. Written by `lanternfish farm openjd`."
                .to_owned(),
        parameter_definitions: parameters,
        steps: job
            .has_lesson()
            .then(|| lesson_step(job))
            .into_iter()
            .chain([render_step(job), merge_step(job)])
            .collect(),
    };
    Ok((template, values))
}

/// What is in the file beside the template that a job bundle of Deadline Cloud has its values in.
pub fn bundle_values(values: &[(&'static str, String)]) -> Value {
    let values: Vec<Value> = values.iter().map(|(name, value)| json!({ "name": name, "value": value })).collect();
    json!({ "parameterValues": values })
}

/// What the scripts call the parts of a frame that go by a lesson, and those that do not.
fn is_taught(job: &FarmJob) -> &'static str {
    if job.has_lesson() { "yes" } else { "no" }
}

fn lesson_step(job: &FarmJob) -> Step {
    let space = job.frames.is_some().then(|| json!({ "taskParameterDefinitions": [frame_parameter()] }));
    Step { name: "Lesson", dependencies: None, ..rendering_step(job, "0", space) }
}

fn render_step(job: &FarmJob) -> Step {
    let part = json!({ "name": "Part", "type": "INT", "range": "1-{{Param.Parts}}" });
    let space = if job.frames.is_some() {
        json!({ "taskParameterDefinitions": [frame_parameter(), part], "combination": "Frame * Part" })
    } else {
        json!({ "taskParameterDefinitions": [part] })
    };
    let dependencies = job.has_lesson().then(|| json!([{ "dependsOn": "Lesson" }]));
    Step { name: "Render", dependencies, ..rendering_step(job, "{{Task.Param.Part}}", Some(space)) }
}

/// A step whose tasks render, each the part `part` of a frame.
fn rendering_step(job: &FarmJob, part: &'static str, parameter_space: Option<Value>) -> Step {
    let mut arguments = vec![
        "{{Task.File.Render}}",
        "{{Param.Program}}",
        "{{Param.Scene}}",
        "{{Param.Output}}",
        "{{Param.Parts}}",
        part,
        is_taught(job),
        "{{Param.RenderOptions}}",
    ];
    if job.frames.is_some() {
        arguments.push("{{Task.Param.Frame}}");
    }
    let cancelation = json!({ "mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": NOTICE });
    Step {
        name: "Render",
        dependencies: None,
        host_requirements: host(),
        parameter_space,
        script: Script {
            actions: json!({ "onRun": { "command": "sh", "args": arguments, "cancelation": cancelation } }),
            embedded_files: text_file("Render", include_str!("openjd_render.sh").to_owned()),
        },
    }
}

fn merge_step(job: &FarmJob) -> Step {
    let keep = if job.keep_parts { "yes" } else { "no" };
    let awaited: Vec<Value> = job
        .has_lesson()
        .then_some("Lesson")
        .into_iter()
        .chain(["Render"])
        .map(|step| json!({ "dependsOn": step }))
        .collect();
    let mut arguments = vec![
        "{{Task.File.Merge}}",
        "{{Param.Program}}",
        "{{Param.Output}}",
        "{{Param.Parts}}",
        is_taught(job),
        keep,
        if job.png.is_some() { "{{Param.Png}}" } else { "no" },
    ];
    let parameter_space = job.frames.is_some().then(|| {
        arguments.push("{{Task.Param.Frame}}");
        json!({ "taskParameterDefinitions": [frame_parameter()] })
    });
    Step {
        name: "Merge",
        dependencies: Some(json!(awaited)),
        host_requirements: host(),
        parameter_space,
        script: Script {
            actions: json!({ "onRun": { "command": "sh", "args": arguments } }),
            embedded_files: text_file("Merge", [NUMBERED, include_str!("openjd_merge.sh")].concat()),
        },
    }
}

fn frame_parameter() -> Value {
    json!({ "name": "Frame", "type": "INT", "range": "{{Param.Frames}}" })
}

/// The scripts are for `sh`.
fn host() -> Value {
    json!({ "attributes": [{ "name": "attr.worker.os.family", "anyOf": ["linux"] }] })
}

fn text_file(name: &str, data: String) -> Value {
    json!([{ "name": name, "type": "TEXT", "data": data }])
}

/// A name as `JobName` allows it: a format string of at most 128 characters.
fn title(label: &str) -> String {
    label.replace("{{", "{ {").chars().take(128).collect()
}
