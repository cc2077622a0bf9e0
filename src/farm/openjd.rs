//! Open Job Description: a template that contains its scripts.

use serde_json::{Value as Json, json};

use super::division::{Division, JobFile};

pub(super) fn files(division: &Division) -> Vec<JobFile> {
    let mut frames = json!({
        "name": "Tasks",
        "parameterSpace": {
            "taskParameterDefinitions": [
                { "name": "Task", "type": "STRING", "range": division.arguments },
            ],
        },
        "script": script(&division.task, &["{{Task.Param.Task}}"]),
    });
    if division.cores > 1 {
        frames["hostRequirements"] =
            json!({ "amounts": [{ "name": "amount.worker.vcpu", "min": division.cores }] });
    }
    let mut steps = vec![frames];
    if let Some(last) = &division.last {
        steps.push(json!({
            "name": "Last",
            "dependencies": [{ "dependsOn": "Tasks" }],
            "script": script(last, &[]),
        }));
    }
    let template = json!({
        "specificationVersion": "jobtemplate-2023-09",
        "name": "ivcam",
        "steps": steps,
    });
    vec![JobFile::new("job.json", format!("{template:#}\n"))]
}

/// Returns the action that runs a shell script with arguments.
fn script(text: &str, arguments: &[&str]) -> Json {
    let mut words = vec!["{{Task.File.Run}}"];
    words.extend(arguments);
    json!({
        "embeddedFiles": [{ "name": "Run", "type": "TEXT", "data": without_fields(text) }],
        "actions": { "onRun": { "command": "sh", "args": words } },
    })
}

/// Separates braces by an empty pair of quotes. `{{` would begin a field of the template and `}}`
/// end one, and there is no escape for them. A shell's word with a brace is in single quotes, so it
/// stays the same.
fn without_fields(script: &str) -> String {
    let mut text = String::with_capacity(script.len());
    for c in script.chars() {
        if "{}".contains(c) && text.ends_with(c) {
            text += "''";
        }
        text.push(c);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::shell::{ShellWord, script as shell_script};

    #[test]
    fn a_template_has_the_tasks_and_the_step_that_depends_on_them() {
        let name = "{{{a}} \"b\".iv".to_owned();
        let division = Division {
            task: shell_script(
                "Makes.",
                "/",
                &[vec![
                    "echo".into(),
                    name.as_str().into(),
                    ShellWord::Argument,
                ]],
            ),
            arguments: vec!["0-1".into(), "2-3".into()],
            last: Some("true\n".into()),
            cores: 4,
        };
        let files = files(&division);
        let template: Json = serde_json::from_str(&files[0].content).unwrap();
        let step = &template["steps"][0];
        let task = &step["parameterSpace"]["taskParameterDefinitions"][0];
        assert_eq!(task["range"], json!(["0-1", "2-3"]));
        let text = step["script"]["embeddedFiles"][0]["data"].as_str().unwrap();
        assert!(text.contains(r#"'{''{''{a}''} "b".iv'"#), "{text}");
        assert!(!text.contains("{{") && !text.contains("}}"), "{text}");
        let after = &template["steps"][1]["dependencies"][0]["dependsOn"];
        assert_eq!(after, &step["name"]);
        assert_eq!(step["hostRequirements"]["amounts"][0]["min"], 4);
    }
}
