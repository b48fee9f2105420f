//! Finds the file of a mesh by its name in a URDF.

use std::path::{Path, PathBuf};

/// Finds a mesh that a URDF names: `package://NAME/rest` (or `model://`), `file://` and a path, or a path relative to
/// the folder of the URDF. A package is searched upward from this folder, then in the folders of `roots`.
pub fn find(name: &str, urdf: &Path, roots: &[PathBuf]) -> Option<PathBuf> {
    let candidates = candidates(name, urdf, roots);
    let found = candidates.iter().find(|path| path.is_file()).cloned();
    // A file system that does not tell cases apart finds `a.STL` where the URDF names `a.stl`.
    found.or_else(|| {
        let mut cased = candidates.iter().flat_map(|path| {
            let extension = path.extension().unwrap_or_default().to_string_lossy();
            [extension.to_lowercase(), extension.to_uppercase()]
                .map(|extension| path.with_extension(extension))
        });
        cased.find(|path| path.is_file())
    })
}

/// The folders of `ROS_PACKAGE_PATH`.
pub fn package_roots() -> Vec<PathBuf> {
    std::env::var_os("ROS_PACKAGE_PATH")
        .map_or(Vec::new(), |paths| std::env::split_paths(&paths).collect())
}

/// Paths at which a mesh may be, best first.
fn candidates(name: &str, urdf: &Path, roots: &[PathBuf]) -> Vec<PathBuf> {
    let urdf = std::path::absolute(urdf).unwrap_or_else(|_| urdf.into());
    let mut folders = urdf.ancestors().skip(1);
    let in_package = ["package://", "model://"]
        .iter()
        .find_map(|scheme| name.strip_prefix(scheme));
    let Some(in_package) = in_package else {
        let path = name.strip_prefix("file://").unwrap_or(name);
        return folders
            .next()
            .map(|folder| folder.join(path))
            .into_iter()
            .collect();
    };
    // Some files have three slashes.
    let in_package = in_package.trim_start_matches('/');
    let (package, rest) = in_package.split_once('/').unwrap_or(("", in_package));
    let mut paths = Vec::new();
    for folder in folders {
        // `folder` may contain the package, or be the package under another name.
        paths.extend([folder.join(package).join(rest), folder.join(rest)]);
    }
    for root in roots {
        paths.push(root.join(package).join(rest));
        if root.file_name().is_some_and(|name| name == package) {
            paths.push(root.join(rest));
        }
    }
    paths
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn packages_are_searched_upward_and_then_in_the_given_folders() {
        let folder = tempfile::tempdir().unwrap();
        let at = |path: &str| folder.path().join(path);
        for path in [
            "work/mine_description/urdf/mine.urdf",
            "work/mine_description/meshes/a.stl",
            "work/other/b.stl",
            "ros/third/c.stl",
            "ros/third/deep/d.stl",
            "work/mine_description/urdf/e.stl",
        ] {
            fs::create_dir_all(at(path).parent().unwrap()).unwrap();
            fs::write(at(path), "").unwrap();
        }
        let urdf = at("work/mine_description/urdf/mine.urdf");
        let find = |name: &str, roots: &[PathBuf]| find(name, &urdf, roots);
        let ros = [at("ros"), at("ros/third")];
        for (name, expected) in [
            (
                "package://mine_description/meshes/a.stl",
                Some("work/mine_description/meshes/a.stl"),
            ),
            (
                "model://mine_description/meshes/a.stl",
                Some("work/mine_description/meshes/a.stl"),
            ),
            // The folder of the package was renamed.
            (
                "package://yours_description/meshes/a.stl",
                Some("work/mine_description/meshes/a.stl"),
            ),
            ("package://other/b.stl", Some("work/other/b.stl")),
            ("package:///other/b.stl", Some("work/other/b.stl")),
            ("package://third/c.stl", Some("ros/third/c.stl")),
            ("package://fourth/c.stl", None),
            ("e.stl", Some("work/mine_description/urdf/e.stl")),
            (
                "../meshes/a.stl",
                Some("work/mine_description/urdf/../meshes/a.stl"),
            ),
            ("a.stl", None),
            (
                "../meshes/a.STL",
                Some("work/mine_description/urdf/../meshes/a.stl"),
            ),
            ("meshes", None),
        ] {
            assert_eq!(find(name, &ros), expected.map(&at), "{name}");
        }
        assert_eq!(
            find("package://third/deep/d.stl", &ros[1..]),
            Some(at("ros/third/deep/d.stl"))
        );
        assert_eq!(find("package://third/c.stl", &[]), None);
        let absolute = at("work/other/b.stl");
        assert_eq!(
            find(&format!("file://{}", absolute.display()), &[]),
            Some(absolute.clone())
        );
        assert_eq!(find(absolute.to_str().unwrap(), &[]), Some(absolute));
    }
}
