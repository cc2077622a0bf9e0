pub use ivcam::{diag, lens, math};
#[path = "../src/cli/lens.rs"]
mod cli;
fn main() {
    let m = cli::command().get_matches();
    match cli::run(&m, &mut std::io::stdout()) {
        Ok(c) => std::process::exit(c),
        Err(e) => {
            eprintln!("{}", e.render(false));
            std::process::exit(2)
        }
    }
}
