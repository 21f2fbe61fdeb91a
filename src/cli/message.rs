//! Messages of the command on standard error beside its progress: wrapped to the terminal, silenced by `--quiet`.

use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::sync::OnceLock;

/// The heading of options about messages, which every subcommand has.
const HEADING: &str = "Messages";

/// How much the command says; the same for the whole process.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub(super) struct Voice {
    /// Say nothing on standard error but why the command failed: no progress, no notes
    #[arg(long, short, global = true, help_heading = HEADING)]
    pub quiet: bool,
    /// Say more: the attempts of the flow solver where the direct way failed
    #[arg(long, short, global = true, help_heading = HEADING, conflicts_with = "quiet")]
    pub verbose: bool,
}

static VOICE: OnceLock<Voice> = OnceLock::new();

impl Voice {
    /// Takes this voice for the whole process.
    pub fn raise(self) {
        VOICE.get_or_init(|| self);
    }

    /// The voice of the process.
    pub fn current() -> Self {
        VOICE.get().copied().unwrap_or_default()
    }
}

/// A message that is no failure; silent under `--quiet`.
pub(super) fn note(text: impl Display) {
    if !Voice::current().quiet {
        say(text);
    }
}

/// A message after the name of the command. One that cannot be written is lost, and nothing else: a closed pipe or a
/// full disk behind standard error must not end a computation.
pub(super) fn say(text: impl Display) {
    let width = if std::io::stderr().is_terminal() { terminal_width() } else { usize::MAX };
    let text = wrapped(&format!("aeroform: {text}"), width, "  ") + "\n";
    // one write, so that messages of several processes do not mix within a line
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// A paragraph for standard output, in lines that fit its terminal; one line where it is none.
pub(super) fn paragraph(text: &str) -> String {
    let terminal = console::Term::stdout();
    let width = if terminal.is_term() { usize::from(terminal.size().1) } else { usize::MAX };
    wrapped(text, width, "")
}

/// An item of a list for standard output, indented, in lines that fit its terminal. Comparisons such as `x ≤ 0.1` are
/// not broken.
pub(super) fn item(text: &str) -> String {
    let terminal = console::Term::stdout();
    let width = if terminal.is_term() { usize::from(terminal.size().1) } else { usize::MAX };
    wrapped_item(text, width)
}

fn wrapped_item(text: &str, width: usize) -> String {
    const GLUE: char = '\u{a0}';
    let mut glued = format!("  {text}");
    for sign in ["≤", "≥", "=", "…"] {
        glued = glued.replace(&format!(" {sign} "), &format!("{GLUE}{sign}{GLUE}"));
    }
    wrapped(&glued, width, "    ").replace(GLUE, " ")
}

fn terminal_width() -> usize {
    console::Term::stderr().size_checked().map_or(80, |(_, columns)| usize::from(columns))
}

/// Lines of at most `width` columns; those after the first of a paragraph begin with `indent`. Words are not broken, so
/// that paths and numbers can be copied.
fn wrapped(text: &str, width: usize, indent: &str) -> String {
    if width == usize::MAX {
        return text.to_string();
    }
    let options = textwrap::Options::new(width.max(20)).subsequent_indent(indent).break_words(false);
    let paragraph =
        |line: &str| textwrap::fill(line, options.clone().word_splitter(textwrap::WordSplitter::NoHyphenation));
    text.lines().map(paragraph).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::{wrapped, wrapped_item};

    #[test]
    fn messages_fit_the_terminal_and_words_stay_whole() {
        let text = "a message about /a/path-that/is/longer-than-the-terminal/is-wide and what to do about it";
        let lines = wrapped(text, 30, "  ");
        assert_eq!(
            lines,
            "a message about\n  /a/path-that/is/longer-than-the-terminal/is-wide\n  and what to do about it"
        );
        assert_eq!(wrapped(text, usize::MAX, "  "), text);
        assert_eq!(wrapped("one\ntwo", 40, "  "), "one\ntwo");
        let item = "bounds of 3 of 9 variables: dy[0,1] ≤ 0.1, dx[2,1] ≥ -0.05 without need, dy[1,1] ≤ 0.2";
        assert_eq!(
            wrapped_item(item, 40),
            "  bounds of 3 of 9 variables:\n    dy[0,1] ≤ 0.1, dx[2,1] ≥ -0.05\n    without need, dy[1,1] ≤ 0.2"
        );
    }
}
