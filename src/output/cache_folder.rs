//! Where a program keeps for its next run what it can make again.

use std::ffi::OsString;
use std::path::PathBuf;

/// The program's folder in the user's cache: `$XDG_CACHE_HOME/cumuli` or `~/.cache/cumuli`
/// (`~/Library/Caches/cumuli` on macOS, `%LOCALAPPDATA%\\cumuli` on Windows). None where the system does
/// not tell; it need not be there yet.
pub(crate) fn cache_folder() -> Option<PathBuf> {
    folder_by(|name| std::env::var_os(name))
}

fn folder_by(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    // The XDG base directory specification: relative paths are to be ignored.
    let absolute = |name| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let usual = || match std::env::consts::OS {
        "windows" => absolute("LOCALAPPDATA"),
        "macos" => absolute("HOME").map(|home| home.join("Library/Caches")),
        _ => absolute("HOME").map(|home| home.join(".cache")),
    };
    let cache = absolute("XDG_CACHE_HOME").or_else(usual)?;
    Some(cache.join("cumuli"))
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn it_is_where_the_system_says() {
        let folder = |variables: &[(&str, &str)]| {
            let value = |name: &str| variables.iter().find(|v| v.0 == name).map(|v| v.1.into());
            folder_by(value)
        };
        let path = |text: &str| Some(PathBuf::from(text));
        assert_eq!(folder(&[("XDG_CACHE_HOME", "/c"), ("HOME", "/h")]), path("/c/cumuli"));
        assert_eq!(folder(&[("XDG_CACHE_HOME", "c"), ("HOME", "/h")]), path("/h/.cache/cumuli"));
        assert_eq!(folder(&[("HOME", "h")]), None);
        assert_eq!(folder(&[]), None);
    }
}
