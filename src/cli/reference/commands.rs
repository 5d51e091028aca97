//! The page of the command line.

use clap::{Arg, Command};

const HEAD: &str = "\
# The command line

<!-- Written by `asperity reference`; the source is the code. -->

Exit codes: 0 done, 1 a task or a file failed, 2 the manifest or the command line is wrong, 130 stopped
by Ctrl-C, 143 by `kill`, 129 with its terminal.

`ASPERITY_DATA` stands for `--data`. `ASPERITY_SIMD` chooses between `avx512`, `avx2` and `portable`, the
widest that the processor has when left out. `NO_COLOR` turns colours off.
";

/// The text of the page.
pub fn page(mut command: Command) -> String {
    command.build();
    let mut page = HEAD.to_owned();
    let global: Vec<&Arg> = command.get_arguments().filter(|arg| arg.is_global_set()).collect();
    page += "\nEvery command has\n\n";
    global.iter().for_each(|arg| page += &item(arg));
    let commands = command.get_subcommands().filter(|command| !command.is_hide_set());
    for command in commands.filter(|command| command.get_name() != "help") {
        page += &of_command(command);
    }
    page
}

fn of_command(command: &Command) -> String {
    let about = command.get_long_about().or(command.get_about());
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ").trim();
    let mut text = format!(
        "\n## `asperity {}`\n\n{}\n\n```text\n{usage}\n```\n",
        command.get_name(),
        about.map_or_else(String::new, |about| sentence(&about.to_string())),
    );
    let own = command.get_arguments().filter(|arg| !arg.is_global_set() && !arg.is_hide_set());
    let own: Vec<&Arg> =
        own.filter(|arg| !["help", "version"].contains(&arg.get_id().as_str())).collect();
    if !own.is_empty() {
        text.push('\n');
    }
    own.iter().for_each(|arg| text += &item(arg));
    text
}

fn item(arg: &Arg) -> String {
    let value = arg.get_value_names().unwrap_or_default().first();
    let value = value.filter(|_| arg.get_action().takes_values()).map(|value| value.to_string());
    let name = match (arg.get_short(), arg.get_long()) {
        (Some(short), Some(long)) => format!("-{short}, --{long}"),
        (None, Some(long)) => format!("--{long}"),
        _ => value.clone().unwrap_or_default(),
    };
    let value = value.filter(|_| arg.get_long().is_some());
    let value = value.map_or_else(String::new, |value| format!(" <{value}>"));
    let about = arg.get_long_help().or(arg.get_help());
    let about = about.map_or_else(String::new, |about| sentence(&about.to_string()));
    let words: Vec<String> = arg
        .get_possible_values()
        .iter()
        .filter(|word| !word.is_hide_set())
        .map(|word| format!("`{}`", word.get_name()))
        .collect();
    let words = match arg.get_action().takes_values() && !words.is_empty() {
        true => format!(" One of {}.", words.join(", ")),
        false => String::new(),
    };
    let default = arg.get_default_values().first().filter(|_| arg.get_action().takes_values());
    let default = default
        .map_or_else(String::new, |value| format!(" Default: `{}`.", value.to_string_lossy()));
    format!("- `{name}{value}` – {about}{words}{default}\n")
}

/// On one line, with a full stop.
fn sentence(text: &str) -> String {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match text.ends_with(['.', '!', '?']) {
        true => text,
        false => text + ".",
    }
}
