//! The command `aeroform`; everything it does is in the library.

fn main() -> std::process::ExitCode {
    aeroform::cli::main()
}
