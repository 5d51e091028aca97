//! Metadata file in the format RO-Crate 1.1, <https://w3id.org/ro/crate/1.1>, for repositories.
//!
//! It describes the archive, each of its files, and the run that made the tables from the manifest
//! and the input files.

use std::collections::BTreeMap;
use std::io;

use serde_json::{Value, json};

use super::ShareOptions;
use super::archive::{ArchivedFile, CHECKSUMS, FileRole};

/// File name required by the specification.
pub(crate) const FILE: &str = "ro-crate-metadata.json";

/// Returns the text of the metadata file of an archive with these files. `about` describes the
/// study `study`.
///
/// # Errors
/// Returns an error if a file cannot be read.
pub(crate) fn metadata(
    study: &str,
    about: &str,
    files: &BTreeMap<String, ArchivedFile>,
    options: &ShareOptions,
) -> io::Result<String> {
    let of = |role: FileRole| {
        let in_role = files.iter().filter(move |(_, file)| file.role == role);
        in_role.map(|(path, _)| reference(&address(path))).collect::<Vec<_>>()
    };
    let manifest = of(FileRole::Manifest);
    let mut graph = vec![
        json!({
            "@id": FILE,
            "@type": "CreativeWork",
            "about": reference("./"),
            "conformsTo": reference("https://w3id.org/ro/crate/1.1"),
        }),
        root(study, about, files, &manifest, options),
    ];
    graph.extend(options.license.as_ref().map(|license| {
        json!({
            "@id": license_address(license),
            "@type": "CreativeWork",
            "name": license,
            "description": format!("The license of this study: {license}"),
        })
    }));
    graph.extend(options.authors.iter().enumerate().map(
        |(index, name)| json!({ "@id": author_address(index), "@type": "Person", "name": name }),
    ));
    graph.push(json!({
        "@id": "#asperity",
        "@type": "SoftwareApplication",
        "name": "asperity",
        "softwareVersion": env!("CARGO_PKG_VERSION"),
        "description": env!("CARGO_PKG_DESCRIPTION"),
    }));
    let read = [manifest, of(FileRole::Input)].concat();
    graph.push(json!({
        "@id": "#run",
        "@type": "CreateAction",
        "name": format!("asperity run of the study {study}"),
        "instrument": reference("#asperity"),
        "object": as_value(read),
        "result": as_value(of(FileRole::Table)),
    }));
    for (path, file) in files {
        graph.push(json!({
            "@id": address(path),
            "@type": "File",
            "name": path,
            "description": file.about,
            "contentSize": file.source.size()?.to_string(),
            "encodingFormat": format_of(path),
        }));
    }
    let text = json!({ "@context": "https://w3id.org/ro/crate/1.1/context", "@graph": graph });
    Ok(format!("{text:#}\n"))
}

fn root(
    study: &str,
    about: &str,
    files: &BTreeMap<String, ArchivedFile>,
    manifest: &[Value],
    options: &ShareOptions,
) -> Value {
    let parts = files.keys().map(|path| reference(&address(path)));
    let mut root = json!({
        "@id": "./",
        "@type": "Dataset",
        "name": format!("{study}: a statistical study of rough contact"),
        "description": about,
        "datePublished": options.date.to_string(),
        "keywords": ["contact mechanics", "roughness", "tribology", "boundary element method"],
        "hasPart": as_value(parts.collect()),
        "mentions": reference("#run"),
    });
    if let Some(manifest) = manifest.first() {
        root["mainEntity"] = manifest.clone();
    }
    if !options.authors.is_empty() {
        let authors = (0..options.authors.len()).map(|index| reference(&author_address(index)));
        root["author"] = as_value(authors.collect());
    }
    // The specification requires a license or a text.
    root["license"] = match &options.license {
        Some(license) => reference(&license_address(license)),
        None => json!("No license is given; ask the authors."),
    };
    root
}

fn format_of(path: &str) -> &'static str {
    match path.rsplit_once('.').map_or("", |(_, ending)| ending) {
        "parquet" => "application/vnd.apache.parquet",
        "toml" => "application/toml",
        "json" => "application/json",
        "csv" => "text/csv",
        "txt" => "text/plain",
        _ if path == CHECKSUMS => "text/plain",
        _ => "application/octet-stream",
    }
}

/// Returns a list, or the value itself if there is only one, as the specification recommends.
fn as_value(mut values: Vec<Value>) -> Value {
    match values.len() {
        1 => values.remove(0),
        _ => values.into(),
    }
}

fn reference(id: &str) -> Value {
    json!({ "@id": id })
}

/// Returns the URL of a license, which for SPDX identifiers is on spdx.org.
fn license_address(license: &str) -> String {
    if license.contains("://") {
        license.to_owned()
    } else {
        format!("https://spdx.org/licenses/{}", address(license))
    }
}

fn author_address(index: usize) -> String {
    format!("#author-{}", index + 1)
}

/// Encodes a path as a relative URL (RFC 3986).
fn address(path: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~/".contains(&byte);
    let letters = path.bytes().map(|byte| {
        if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") }
    });
    letters.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::share::archive::Source;

    fn graph(license: Option<&str>) -> Vec<Value> {
        let options = ShareOptions {
            output: None,
            store: false,
            replace: false,
            license: license.map(str::to_owned),
            authors: vec!["Ada Lovelace".to_owned(), "Heinrich Hertz".to_owned()],
            date: "2026-11-22".parse().unwrap(),
        };
        let files = [
            ("small.toml", FileRole::Manifest),
            ("maps/Größe 1.x3p", FileRole::Input),
            ("data/results/small/area.parquet", FileRole::Table),
        ];
        let files = files.map(|(path, role)| {
            let source = Source::Bytes(vec![0; 3]);
            (path.to_owned(), ArchivedFile { source, role, about: String::new() })
        });
        let text = metadata("small", "A study.", &files.into(), &options).unwrap();
        let text: Value = serde_json::from_str(&text).unwrap();
        text["@graph"].as_array().unwrap().clone()
    }

    #[test]
    fn every_reference_exists_exactly_once() {
        let graph = graph(Some("CC-BY-4.0"));
        let known: Vec<&str> = graph.iter().map(|entity| entity["@id"].as_str().unwrap()).collect();
        let outside = "https://w3id.org/ro/crate/1.1";
        for entity in &graph {
            let id = entity["@id"].as_str().unwrap();
            assert_eq!(known.iter().filter(|known| **known == id).count(), 1, "{id}");
            let values = entity.as_object().unwrap().values();
            let lists =
                values.flat_map(|value| value.as_array().cloned().unwrap_or(vec![value.clone()]));
            for named in lists.filter_map(|value| Some(value.get("@id")?.as_str()?.to_owned())) {
                assert!(known.contains(&named.as_str()) || named == outside, "{named}");
            }
        }
    }

    #[test]
    fn the_run_makes_tables_from_manifest_and_inputs() {
        let graph = graph(None);
        let run = graph.iter().find(|entity| entity["@id"] == "#run").unwrap();
        let inputs = json!([{ "@id": "small.toml" }, { "@id": "maps/Gr%C3%B6%C3%9Fe%201.x3p" }]);
        assert_eq!(run["object"], inputs);
        assert_eq!(run["result"], json!({ "@id": "data/results/small/area.parquet" }));
    }

    #[test]
    fn authors_are_persons_in_their_order() {
        let graph = graph(None);
        let authors = graph[1]["author"].as_array().unwrap();
        let name = |author: &Value| {
            let found = graph.iter().find(|entity| entity["@id"] == author["@id"]);
            found.map(|entity| entity["name"].clone())
        };
        assert_eq!(name(&authors[0]), Some(json!("Ada Lovelace")));
        assert_eq!(name(&authors[1]), Some(json!("Heinrich Hertz")));
    }

    #[test]
    fn a_license_is_one_of_spdx_or_has_an_address() {
        let address = |license| graph(Some(license))[1]["license"]["@id"].clone();
        assert_eq!(address("CC-BY-4.0"), "https://spdx.org/licenses/CC-BY-4.0");
        assert_eq!(address("https://example.org/l"), "https://example.org/l");
        assert!(graph(None)[1]["license"].is_string());
    }
}
