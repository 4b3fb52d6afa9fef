//! `docs/cli.md`: what the help says, as one page.

use super::Arguments;
use clap::{Arg, ArgAction, Command, CommandFactory};
use std::fmt::Write;

/// The command line as Markdown.
pub fn help_markdown() -> String {
    let mut program = Arguments::command().disable_help_subcommand(true);
    program.build();
    let mut page = String::from(
        "# The `facewright` program\n\n\
         <!-- Written from the program's help: REFRESH=1 cargo test --release -p facewright docs -->\n\n",
    );
    let _ = writeln!(page, "{}.\n", about(&program).trim_end_matches('.'));
    page += "Exit code 0: done. 1: a clear error, in one sentence on standard error. 2: wrong usage.\n\n";
    page += "Of every command:\n\n";
    page += &options(program.get_arguments().filter(|arg| arg.is_global_set()));
    for command in program.get_subcommands() {
        page += &section(command);
    }
    page
}

fn section(command: &Command) -> String {
    let own = |arg: &&Arg| !arg.is_global_set() && !is_help(arg) && !arg.is_hide_set();
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ");
    let positional = list(command.get_positionals().filter(own).map(|arg| {
        let name = arg.get_value_names().map_or_else(String::new, |names| names.join(" "));
        format!("`{name}`: {}", told(arg))
    }));
    let named = options(command.get_arguments().filter(own).filter(|arg| !arg.is_positional()));
    format!("\n## {}\n\n{}.\n\n    {usage}\n\n{positional}{named}", command.get_name(), about(command))
}

fn is_help(arg: &Arg) -> bool {
    matches!(arg.get_action(), ArgAction::Help | ArgAction::HelpShort | ArgAction::HelpLong | ArgAction::Version)
}

fn about(command: &Command) -> String {
    command.get_about().map(ToString::to_string).unwrap_or_default()
}

fn options<'a>(arguments: impl Iterator<Item = &'a Arg>) -> String {
    list(arguments.map(|arg| format!("`{}`: {}", spelling(arg), told(arg))))
}

fn list(items: impl Iterator<Item = String>) -> String {
    items.map(|item| format!("- {item}\n")).collect()
}

/// `-o, --output <OUTPUT>`.
fn spelling(arg: &Arg) -> String {
    let short = arg.get_short().map(|short| format!("-{short}"));
    let long = arg.get_long().map(|long| format!("--{long}"));
    let names = short.into_iter().chain(long).collect::<Vec<_>>().join(", ");
    match arg.get_value_names().filter(|_| arg.get_action().takes_values()) {
        Some(values) => format!("{names} <{}>", values.join("> <")),
        None => names,
    }
}

/// The help, the values it may have and the one it has unless it is given.
fn told(arg: &Arg) -> String {
    let mut told = arg.get_help().map(ToString::to_string).unwrap_or_default();
    if !arg.get_action().takes_values() {
        return told;
    }
    let possible = arg.get_possible_values();
    let values = possible.iter().map(|value| match value.get_help() {
        Some(help) => format!("`{}` ({})", value.get_name(), help),
        None => format!("`{}`", value.get_name()),
    });
    let values = values.collect::<Vec<_>>().join(", ");
    if !values.is_empty() {
        let _ = write!(told, ": {values}");
    }
    let usual = arg.get_default_values().iter().map(|value| value.to_string_lossy().into_owned()).collect::<Vec<_>>();
    if !usual.is_empty() {
        let _ = write!(told, " (default: {})", usual.join(","));
    }
    told
}
