//! Reading the command line: what is wrong with it is said in one line.

use std::{ffi::OsString, process::ExitCode};

use clap::{Parser, error::ErrorKind};

/// Reads a command line.
///
/// # Errors
///
/// The code to leave with, once the help is printed or the mistake is told.
pub fn parse<T: Parser>(words: impl IntoIterator<Item = OsString>) -> Result<T, ExitCode> {
    T::try_parse_from(words).map_err(|error| {
        let kind = error.kind();
        let help = matches!(kind, ErrorKind::DisplayHelp | ErrorKind::DisplayVersion);
        if help || kind == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
            // Nothing can be done where even the help cannot be printed.
            let _ = error.print();
        } else {
            eprintln!("{}", one_line(&error.to_string()));
        }
        ExitCode::from(if help { 0 } else { 2 })
    })
}

/// What clap says before it repeats the usage, and where to read more.
fn one_line(text: &str) -> String {
    let text = text
        .split("\n\nFor more information")
        .next()
        .unwrap_or(text);
    let (mistake, rest) = text.split_once("\n\nUsage: ").unwrap_or((text, ""));
    let mistake: Vec<&str> = mistake.split_whitespace().collect();
    let verb: Vec<&str> = rest
        .split_whitespace()
        .take_while(|word| !word.starts_with(['-', '[', '<']))
        .collect();
    let more = if verb.is_empty() {
        String::new()
    } else {
        format!(" (`{} --help` says more)", verb.join(" "))
    };
    format!("{}{more}", mistake.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Parser)]
    #[command(name = "fly")]
    struct Arguments {
        #[arg(long, default_value_t = 1)]
        wings: u8,
        #[arg(required = true)]
        place: Vec<String>,
    }

    fn mistake(line: &str) -> String {
        one_line(
            &Arguments::try_parse_from(line.split(' '))
                .unwrap_err()
                .to_string(),
        )
    }

    #[test]
    fn a_mistake_is_one_line_that_names_the_argument() {
        for (line, word) in [
            ("fly", "<PLACE>..."),
            ("fly --wings x there", "--wings"),
            ("fly --tail there", "--tail"),
        ] {
            let said = mistake(line);
            assert!(
                said.starts_with("error: ") && said.contains(word) && !said.contains('\n'),
                "{said}"
            );
        }
        assert!(
            mistake("fly").ends_with("(`fly --help` says more)"),
            "{}",
            mistake("fly")
        );
    }

    #[test]
    fn good_lines_are_read() {
        let arguments: Arguments =
            parse(["fly", "--wings", "2", "there"].map(OsString::from)).unwrap();
        assert_eq!((arguments.wings, arguments.place.len()), (2, 1));
    }
}
