//! Writes the pairs of a report as a table of comma-separated values.

use serde_json::Value as Json;

use super::entry::{PairEntry, ReportData};
use crate::archive::csv::row;
use crate::compare::METRICS;

/// Returns the table: a row for each pair. A value that does not exist is empty.
pub(super) fn table(data: &ReportData) -> String {
    let before = ["new", "old", "paired_by", "verdict", "registration"];
    let after = [
        "pixels", "shift_x", "shift_y", "scale", "rotation", "mirrored", "chance", "message",
    ];
    let head = before
        .into_iter()
        .chain(METRICS.map(|m| m.name))
        .chain(after);
    let mut text = row(head);
    data.pairs
        .iter()
        .for_each(|pair| text += &row(fields(pair)));
    text
}

fn fields(pair: &PairEntry) -> Vec<String> {
    let paired_by = serde_json::to_value(pair.paired_by).unwrap_or_default();
    let mut fields = vec![
        pair.new.clone(),
        pair.old.clone(),
        paired_by.as_str().unwrap_or_default().to_owned(),
        pair.verdict.name().to_owned(),
        pair.registration.clone(),
    ];
    let number = |value: f64| match value.is_nan() {
        true => String::new(),
        false => value.to_string(),
    };
    fields.extend(METRICS.iter().map(|metric| number(pair.value(metric))));
    let comparison = pair.comparison.as_ref().unwrap_or(&Json::Null);
    let alignment = &comparison["alignment"];
    let places = [
        &comparison["pixels"],
        &alignment["shift"][0],
        &alignment["shift"][1],
        &alignment["scale"],
        &alignment["rotation"],
        &alignment["mirrored"],
        &alignment["chance"],
    ];
    fields.extend(places.map(|value| match value {
        Json::Null => String::new(),
        value => value.to_string(),
    }));
    fields.push(pair.error.clone().unwrap_or_default());
    fields
}
