//! include/shellwarp.h is what cbindgen makes of src/ffi today. `make header` rewrites it.
#![allow(missing_docs)]

use std::path::Path;

const SOURCES: [&str; 11] =
    ["status", "pointer", "log", "mesh", "model", "state", "batch", "constraint", "load", "plan", "certify"];

#[test]
fn header_is_current() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).unwrap();
    let mut builder = cbindgen::Builder::new().with_config(config);
    for name in SOURCES {
        builder = builder.with_src(root.join(format!("src/ffi/{name}.rs")));
    }
    let mut text = vec![];
    builder.generate().unwrap().write(&mut text);
    let text = String::from_utf8(text).unwrap().replace("\r\n", "\n");
    let path = root.join("include/shellwarp.h");
    if std::env::var_os("UPDATE_HEADER").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let present = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(present == text, "include/shellwarp.h is out of date: run `make header`");
}
