fn main() {
    std::process::exit(ivcam::cli::run(std::env::args_os()));
}
