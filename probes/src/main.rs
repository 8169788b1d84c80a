//! The command `sapwise`.

fn main() -> std::process::ExitCode {
    sapwise_cli::Command::new().run()
}
