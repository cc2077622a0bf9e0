//! Reads a prescription. The format is recognized by the content of a file, not by its name.

use std::sync::Arc;

use crate::diag::{Diagnostic, Result, Sink, Source, Span};

use crate::prescription::formats::FORMATS;
use crate::prescription::formats::apertures;
use crate::prescription::formats::format::Reading;
use crate::prescription::prescription::Prescription;
use crate::prescription::text;

/// Reads a prescription in any known format.
///
/// # Errors
/// Returns the errors of [`read_with`].
pub(crate) fn read(source: &Arc<Source>, sink: &mut Sink) -> Result<Prescription> {
    read_with(source, &Reading::default(), sink)
}

/// Reads a prescription in any known format, with given glasses and options.
///
/// # Errors
///
/// Returns an error if the file is in no known format, and the errors of its reader.
pub(crate) fn read_with(
    source: &Arc<Source>,
    how: &Reading,
    sink: &mut Sink,
) -> Result<Prescription> {
    let source = &text::decoded(source);
    let before = sink.set_source(Some(source.clone()));
    let result = known(source).and_then(|()| {
        let text = text::text(source);
        let format = FORMATS.iter().find(|format| (format.recognizes)(text));
        let mut lens = format.map_or_else(
            || Err(Diagnostic::error("this is not a lens prescription").at(source, Span::at(0))),
            |format| (format.read)(source, how, sink),
        )?;
        apertures::close_open_stop(&mut lens, sink);
        apertures::warn_if_afocal(&lens, sink);
        Ok(lens)
    });
    sink.set_source(before);
    result
}

/// Refuses files that are not prescriptions, and names the programs whose formats are not read.
fn known(source: &Arc<Source>) -> Result<()> {
    let text = text::text(source);
    let refuse = |what: &str, span: Span, help: &str| {
        let error = Diagnostic::error(what).at(source, span);
        Err(error.with_help(help))
    };
    let help = "export it as Zemax `.zmx` or CODE V `.seq`, or write its rows as radius, thickness, \
                index, aperture diameter";
    if let Some(at) = text.find('\0') {
        return refuse(
            "this is not text, so it is not a lens prescription",
            Span::at(at),
            "of a Zemax archive (.zar, .zos) open and save the lens as `.zmx`",
        );
    }
    if is_catalogue(text) {
        return refuse(
            "this is a glass catalogue, not a lens",
            Span::at(0),
            "give it as --glass-catalogue FILE.agf",
        );
    }
    let mut lens = None;
    for (start, line) in text::lines(text) {
        let words = text::words(line, start);
        let Some(first) = words.first() else { continue };
        // OSLO: one command a line, `RD`, `TH`, `AP`, `GLA`, surfaces end with `NXT`.
        if first.is("LEN") {
            lens = lens.or(Some(first.span));
        }
        if first.is("NXT") && words.len() == 1 {
            let span = lens.unwrap_or(first.span);
            return refuse("this is a lens file of OSLO, which is not read", span, help);
        }
    }
    Ok(())
}

/// Whether a text is an `.agf` file. Its first line may be any comment, so it is recognized by the
/// lines that name glasses and list their coefficients.
fn is_catalogue(text: &str) -> bool {
    let begins = |key: &str| text.lines().any(|line| line.starts_with(key));
    begins("NM ") && begins("CD ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prescription::formats::write;

    #[test]
    fn a_format_is_known_by_what_the_file_says() {
        for (text, name) in [
            ("# Inch\n10 2 1.5 9\n", "four columns"),
            ("VERS 1\r\nMODE SEQ\r\n", "Zemax"),
            ("RDM;LEN \"x\"\n", "CODE V"),
            ("! old\nlen\ntit 'x'\n", "CODE V"),
            (" {\"surfaces\": []}", "JSON"),
            ("{\"surfaces\": [{\"semi_aperture\": 1}]}", "JSON of ISET"),
            ("", "four columns"),
        ] {
            let format = FORMATS.iter().find(|f| (f.recognizes)(text)).unwrap();
            assert_eq!(format.name, name, "{text}");
        }
        for text in [
            "CC a\nNM A 2\nCD 1 2\n",
            "Copied with permission.\r\nCC a\nNM A 2\nCD 1 2\n",
        ] {
            let agf = Source::new("a.agf", text.as_bytes().to_vec());
            let error = read(&Arc::new(agf), &mut Sink::new()).unwrap_err();
            assert!(error.message.contains("glass catalogue"));
        }
    }

    #[test]
    fn what_is_no_prescription_or_not_read_is_refused_by_name() {
        for (text, says, at) in [
            (
                "// OSLO 6\nLEN NEW \"a\" 50 7\nAIR\nNXT\nRD 21\n",
                "OSLO",
                (2, 1),
            ),
            ("ab\ncd\0\u{1}", "not text", (2, 3)),
        ] {
            let source = Arc::new(Source::new("a", text.as_bytes().to_vec()));
            let error = read(&source, &mut Sink::new()).unwrap_err();
            assert!(error.message.contains(says), "{error}");
            assert_eq!(error.location().1, Some(at), "{error}");
        }
    }

    #[test]
    fn a_missing_zoom_position_is_reported_at_the_list_of_positions() {
        let place = |name: &str| {
            let lens = crate::lens::Lens::named(name).unwrap();
            let error = lens.at_zoom(9).unwrap_err();
            let error = crate::lens::at_zoom_list(error, name);
            let (file, at) = error.location();
            (file.unwrap().to_owned(), at.unwrap())
        };
        let (file, (line, column)) = place("canon-70-200");
        assert_eq!(file, "lenses/zoom/canon-70-200.json");
        assert!(line > 5 && column == 2, "{line}:{column}");
        assert_eq!(place("double-gauss").1, (1, 1));
    }

    /// Files with bytes removed, doubled and changed give a lens or an error, and never a panic.
    #[test]
    fn a_damaged_file_is_a_message_and_never_a_panic() {
        let seq = "RDM;LEN\nTITLE 'a'\nDIM M\nEPD 5\nYAN 0 10\nPRV\n PWL 700 486\n 'X' 1.5 1.6\nEND\n\
                   SO 0 1e9\nS 50 3 NBK7_SCHOTT\n CIR 9\n STO\nS -40 2 517642\n ASP; K -1; A 1e-6\n\
                   S -90 95\n CIR 8\nZOO 2\nZOO THI S2 1 2\nSI 0 0\nGO\n";
        let mut texts = vec![seq.to_owned()];
        for name in ["double-gauss", "canon-70-200", "phone"] {
            let lens = crate::lens::Lens::named(name).unwrap();
            for target in [
                write::Target::Columns,
                write::Target::Zemax,
                write::Target::Json,
            ] {
                texts.extend(write::write(lens.prescription(), target).map(|(text, _)| text));
            }
        }
        let mut state = 1_u64;
        let mut random = |below: usize| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 33) as usize % below.max(1)
        };
        let mut read_well = 0;
        for round in 0..1500 {
            let mut bytes = texts[round % texts.len()].clone().into_bytes();
            for _ in 0..=random(4) {
                let at = random(bytes.len());
                match random(4) {
                    0 => bytes.truncate(at),
                    1 => bytes[at] = b"-0.9e;&\"\n{}[],x \xff\0"[random(18)],
                    2 => drop(bytes.drain(at..(at + random(40)).min(bytes.len()))),
                    _ => bytes.insert(at, bytes[at]),
                }
                if bytes.is_empty() {
                    break;
                }
            }
            let source = Arc::new(Source::new("damaged", bytes));
            read_well += usize::from(read(&source, &mut Sink::new()).is_ok());
        }
        assert!(read_well > 100, "{read_well}");
    }
}
