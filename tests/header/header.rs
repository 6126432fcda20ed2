//! include/shellwarp.h is what cbindgen makes of src/ffi today, in the order of the sources. `make header` rewrites it.

use std::collections::HashMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The files of src/ffi in the header's order, and what each is about.
const SECTIONS: [(&str, &str); 22] = [
    ("status", "Statuses, messages and versions"),
    ("structs", "Structs"),
    ("pointer", "Buffers"),
    ("log", "Log"),
    ("mesh", "Meshes"),
    ("material", "Materials"),
    ("model", "Models"),
    ("preset", "Known materials"),
    ("precompute", "Precompute"),
    ("info", "What a model has"),
    ("method", "Methods"),
    ("state", "States"),
    ("supports", "Supports that move"),
    ("output", "What a state shows"),
    ("binding", "Points that follow a shell"),
    ("proxy", "A mesh to simulate in another's place"),
    ("batch", "Many states"),
    ("constraint", "Constraints"),
    ("collider", "Colliders"),
    ("load", "Forces, wind and equilibrium"),
    ("plan", "What a step consists of"),
    ("certify", "What a state gets wrong, and another method for it"),
];

/// Longest line of a comment.
const COLUMNS: usize = 100;

/// Of the project.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn header_is_current() {
    let root = root();
    let text = header(&root);
    let path = root.join("include/shellwarp.h");
    if std::env::var_os("UPDATE_HEADER").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let present = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(present == text, "include/shellwarp.h is out of date: run `make header`");
}

#[test]
fn no_line_of_the_header_is_longer_than_a_screen() {
    let text = header(&root());
    let long: Vec<&str> = text.lines().filter(|line| line.chars().count() > COLUMNS).collect();
    assert!(long.is_empty(), "{long:#?}");
}

/// Hosts of the first version still find what they call. Its structs: tests/growth.
#[test]
fn the_first_headers_constants_and_functions_stay() {
    let root = root();
    let first = std::fs::read_to_string(root.join("tests/growth/first/shellwarp.h")).unwrap();
    let (present, first) = (constants_and_functions(&header(&root)), constants_and_functions(&first));
    let counts = ["#define SW_ABI_VERSION ", "#define SW_PHASE_COUNT "];
    let lost = |text: &&String| !present.contains(text) && !counts.iter().any(|count| text.starts_with(count));
    let lost: Vec<&String> = first.iter().filter(lost).collect();
    assert!(lost.is_empty() && first.len() > 100, "see tests/growth/README.md: {lost:#?}");
}

/// "SW_PHASE_..." stands for all that begin so.
#[test]
fn every_name_in_the_headers_texts_is_declared() {
    let text = header(&root());
    let words = |text: &str| -> Vec<String> {
        let names = text.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned);
        names.filter(|name| ["sw_", "SW_", "Sw"].iter().any(|start| name.starts_with(start))).collect()
    };
    let is_comment = |line: &&str| ["*", "/*", "//"].iter().any(|mark| line.trim_start().starts_with(mark));
    let (comments, code): (Vec<&str>, Vec<&str>) = text.lines().partition(is_comment);
    let declared = words(&code.join("\n"));
    let known = |name: &String| declared.iter().any(|d| d == name || name.ends_with('_') && d.starts_with(&name[..]));
    let unknown: Vec<String> = words(&comments.join("\n")).into_iter().filter(|name| !known(name)).collect();
    assert!(unknown.is_empty() && declared.len() > 300, "{unknown:?}");
}

/// One line for each.
fn constants_and_functions(header: &str) -> Vec<String> {
    let declarations = header.split("#ifndef SHELLWARP_NO_INLINE").next().unwrap();
    let declarations: String = declarations.split("/*").filter_map(|text| text.split("*/").last()).collect();
    let code = || declarations.lines().filter(|line| !line.trim_start().starts_with("//"));
    let constants = code().filter(|line| line.starts_with("#define SW_")).map(str::to_owned);
    let rest: Vec<&str> = code().filter(|line| !line.starts_with('#')).collect();
    let joined = rest.join(" ");
    let functions = joined.split(';').map(|text| text.split_whitespace().collect::<Vec<_>>().join(" "));
    constants.chain(functions.filter(|text| text.ends_with(')') && !text.contains('{'))).collect()
}

fn header(root: &Path) -> String {
    let mut config = cbindgen::Config::from_file(root.join("cbindgen.toml")).unwrap();
    let mut out = config.header.take().unwrap().trim_start().to_owned();
    let mut builder = cbindgen::Builder::new().with_config(config);
    let path = |name: &str| root.join(format!("src/ffi/{name}.rs"));
    for (name, _) in SECTIONS {
        builder = builder.with_src(path(name));
    }
    let mut text = vec![];
    builder.generate().unwrap().write(&mut text);
    let text = String::from_utf8(text).unwrap().replace("\r\n", "\n");
    let mut declared: HashMap<&str, &str> =
        text.split("\n\n").map(str::trim).filter(|c| !c.is_empty()).map(|c| (name_of(c), c)).collect();

    out += "\n#ifndef SHELLWARP_H\n#define SHELLWARP_H\n\n#include <stddef.h>\n#include <stdint.h>\n\n";
    out += "#ifdef __cplusplus\nextern \"C\" {\n#endif\n";
    let mut described = vec![];
    for (file, title) in SECTIONS {
        write!(out, "\n/* {:-<1$} */\n", format!("{title} "), COLUMNS - 6).unwrap();
        let source = std::fs::read_to_string(path(file)).unwrap();
        for (name, apart) in definitions(&source) {
            let Some(declaration) = declared.remove(name) else { continue };
            if declaration.contains("\n  uint32_t struct_size;\n") {
                described.push(name.to_owned());
            }
            out += if apart { "\n" } else { "" };
            out += &wrapped(declaration);
        }
    }
    assert!(declared.is_empty(), "in no file of SECTIONS: {:?}", declared.keys());
    out + &initialisers(&described) + "\n#ifdef __cplusplus\n}\n#endif\n\n#endif\n"
}

/// What a declaration in C declares.
fn name_of(declaration: &str) -> &str {
    let code = declaration.lines().find(|line| !line.starts_with("//")).unwrap();
    let before = |end: char| code.split_once(end).map_or("", |(front, _)| front);
    let word = |text: &'static str| code.strip_prefix(text).and_then(|rest| rest.split([' ', ';']).next());
    match code {
        _ if code.starts_with("#define ") => word("#define ").unwrap(),
        _ if code.starts_with("typedef struct ") => word("typedef struct ").unwrap(),
        _ if code.contains("(*Sw") => code.split("(*").nth(1).unwrap().split(')').next().unwrap(),
        _ if code.starts_with("typedef ") => before(';').rsplit(' ').next().unwrap(),
        _ => before('(').rsplit([' ', '*']).next().unwrap(),
    }
}

/// The public names that a source defines, in order, and whether a blank line comes before each.
fn definitions(source: &str) -> Vec<(&str, bool)> {
    let starts = ["pub const ", "pub struct ", "pub type ", "pub extern \"C\" fn ", "pub unsafe extern \"C\" fn "];
    let mut apart = true;
    let mut found = vec![];
    for line in source.lines() {
        apart |= line.is_empty();
        if let Some(rest) = starts.iter().find_map(|start| line.strip_prefix(start)) {
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap();
            found.push((&rest[..end], apart));
            apart = false;
        }
    }
    found
}

/// The same with its comments' paragraphs filled anew.
fn wrapped(declaration: &str) -> String {
    let mut out = String::new();
    let mut paragraph: Option<(&str, String)> = None;
    let flush = |out: &mut String, paragraph: Option<(&str, String)>| {
        let Some((indent, words)) = paragraph else { return };
        let mut line = format!("{indent}//");
        for word in words.split_whitespace() {
            if line.chars().count() + 1 + word.chars().count() > COLUMNS {
                *out += &line;
                out.push('\n');
                line = format!("{indent}//");
            }
            line = line + " " + word;
        }
        *out += &line;
        out.push('\n');
    };
    for line in declaration.lines() {
        let code = line.trim_start();
        let indent = &line[..line.len() - code.len()];
        let Some(comment) = code.strip_prefix("//") else {
            flush(&mut out, paragraph.take());
            out += line;
            out.push('\n');
            continue;
        };
        let begins = comment.trim().is_empty() || comment.trim_start().starts_with("Errors:");
        match &mut paragraph {
            Some((_, words)) if !begins && !words.is_empty() => *words = format!("{words} {comment}"),
            _ => {
                flush(&mut out, paragraph.take());
                paragraph = Some((indent, comment.trim().to_owned()));
            }
        }
    }
    flush(&mut out, paragraph);
    out
}

/// The init function of each struct that begins with its size: inline, so that the size is the host's.
fn initialisers(structs: &[String]) -> String {
    let mut out = format!("\n/* {:-<1$} */\n\n", "Structs at their defaults ", COLUMNS - 6);
    let about = "// Each writes zeros, and the size that this header gives the struct. NULL does nothing. A \
                 parser that reads declarations alone leaves them out by defining SHELLWARP_NO_INLINE, and calls \
                 sw_struct_init.";
    out += &wrapped(about);
    out += "#ifndef SHELLWARP_NO_INLINE\n";
    for name in structs {
        let mut function = String::new();
        for letter in name[2..].chars() {
            let start = if letter.is_uppercase() { "_" } else { "" };
            write!(function, "{start}{}", letter.to_lowercase()).unwrap();
        }
        write!(out, "static inline void sw{function}_init({name} *s) {{\n  sw_struct_init(s, sizeof *s);\n}}\n")
            .unwrap();
    }
    out + "#endif\n"
}
