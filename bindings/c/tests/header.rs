//! The header that is checked in is the one that the sources say, and the file for CMake has the version.

use std::path::Path;

#[test]
fn header_is_up_to_date() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let stored = folder.join("include/sapwise.h");
    let mut generated = Vec::new();
    cbindgen::generate(folder).unwrap().write(&mut generated);
    let generated = String::from_utf8(generated).unwrap();
    if std::env::var_os("SAPWISE_WRITE_HEADER").is_some() {
        std::fs::write(&stored, &generated).unwrap();
    }
    let is_current = std::fs::read_to_string(&stored).is_ok_and(|stored| stored == generated);
    assert!(is_current, "sapwise.h is stale; run with SAPWISE_WRITE_HEADER=1");
    assert!(generated.lines().count() <= 500, "{} lines", generated.lines().count());
}

#[test]
fn cmake_knows_the_version() {
    let (version, file) = (env!("CARGO_PKG_VERSION"), include_str!("../cmake/sapwise-config-version.cmake"));
    let (minor, _) = version.rsplit_once('.').unwrap();
    assert!(file.contains(&format!("set(PACKAGE_VERSION \"{version}\")")), "write {version}");
    assert!(file.contains(&format!("VERSION_EQUAL {minor} ")), "write {minor}");
}
