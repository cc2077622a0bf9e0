//! Compares docs/options.md with the table of options. With `UPDATE=1` it writes the page below its
//! introduction.

use crate::photo::options::{Opt, Takes, groups};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/options.md");

#[test]
fn the_page_of_options_states_the_table_of_options() {
    let old = std::fs::read_to_string(PAGE).expect("the page is in the repository");
    let introduction = old.split("\n## ").next().unwrap_or_default();
    let tables: Vec<String> = groups()
        .iter()
        .map(|group| {
            let rows: String = group.options.iter().map(row).collect();
            let heading = group.heading;
            format!("\n## {heading}\n\n| option | 1999 | effect [default] |\n|---|---|---|\n{rows}")
        })
        .collect();
    let page = format!("{introduction}{}", tables.concat());
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(PAGE, &page).expect("the page can be written");
    } else {
        assert!(
            page == old,
            "the page is not the table; `UPDATE=1 cargo test -p ivcam --lib option_page` writes it"
        );
    }
}

/// Returns the row of an option: its spellings of today, that of 1999, and its help.
fn row(option: &Opt) -> String {
    let value = match option.takes {
        Takes::Nothing => String::new(),
        Takes::One(name) => format!(" {name}"),
        Takes::Maybe(name, _) => format!("[={name}]"),
        Takes::Many(name) => format!(" {name} …"),
    };
    let dashed = |name: &&str| format!("`-{name}`");
    let short = option.vintage.filter(|old| old.len() == 1);
    let mut spellings: Vec<String> = short.iter().map(dashed).collect();
    spellings.push(format!("`--{}{value}`", option.name));
    spellings.extend(option.aliases.iter().map(|alias| format!("`--{alias}`")));
    let vintage: String = option.vintage.iter().map(dashed).collect();
    let cells = [spellings.join(", "), vintage, option.help.to_owned()];
    let [today, old, help] = cells.map(|cell| cell.replace('|', "\\|"));
    format!("| {today} | {old} | {help} |\n")
}
