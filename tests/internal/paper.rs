//! Compares docs/guide/paper.md with the numbers that rays through its lenses and scenes give.
//!
//! Renders take longer; `measure paper-claims` compares their numbers too, and corrects the page.

#[path = "../../crates/measure/src/paper_numbers.rs"]
mod paper_numbers;
#[path = "../../crates/measure/src/paper_page.rs"]
mod paper_page;

use paper_numbers::{GIVEN, PAGE, RENDERED, quick};
use paper_page::{PageNumbers, corrected};

#[test]
fn the_page_of_the_paper_states_what_rays_give() {
    let page = std::fs::read_to_string(PAGE).expect("the page is in the repository");
    let found = quick().corrections(&page);
    let found = found.unwrap_or_else(|missing| panic!("{PAGE}: {missing}"));
    let found: Vec<&str> = found.iter().map(|c| c.message.as_str()).collect();
    assert!(
        found.is_empty(),
        "{}\n`cargo run --release -p measure -- paper-claims {PAGE}` corrects the page",
        found.join("\n")
    );
}

#[test]
fn every_number_on_the_page_of_the_paper_is_measured_or_given() {
    let page = std::fs::read_to_string(PAGE).expect("the page is in the repository");
    let mut numbers = quick();
    numbers.tables.push(("approaches", String::new()));
    let rest = numbers.unexplained(&page, &[&GIVEN[..], &RENDERED].concat());
    assert_eq!(rest, [""; 0], "nothing measures these");
}

const SAMPLE: &str = "In 1999 the lens\nopens to f/2.7, or 20 mm.\n\n    ivcam -f 3\n\n\
    <!-- numbers: t -->\n\n| 1 |\n\n<!-- end -->\n";

#[test]
fn wrong_numbers_in_sentences_and_tables_are_found_and_corrected() {
    let mut numbers = PageNumbers::default();
    numbers.tables.push(("t", "| 2 |\n".into()));
    numbers.phrase(
        "lens opens to f/{}, or {} mm.",
        ["2.79".into(), "20".into()],
    );
    let found = numbers.corrections(SAMPLE).expect("it has both");
    assert_eq!(found.len(), 2);
    let right = SAMPLE.replace("2.7", "2.79").replace("| 1 |", "| 2 |");
    assert_eq!(corrected(SAMPLE, found), right);
    assert!(numbers.corrections(&right).is_ok_and(|c| c.is_empty()));
    numbers.phrase("words that are {} there", ["not".into()]);
    assert!(numbers.corrections(SAMPLE).is_err());
}

#[test]
fn a_number_that_nothing_measures_is_found_outside_commands_and_tables() {
    let mut numbers = PageNumbers::default();
    assert_eq!(
        numbers.unexplained(SAMPLE, &[]),
        ["1999", "f/2.7,", "20", "1"]
    );
    numbers.tables.push(("t", String::new()));
    numbers.phrase("opens to f/{}, or {} mm.", ["2.7".into(), "20".into()]);
    assert_eq!(numbers.unexplained(SAMPLE, &["In 1999"]), [""; 0]);
}
