//! The command line of Cumuli.

fn main() -> std::process::ExitCode {
    cumuli::cli::main()
}
