//! Manifests of tests, written stage by stage.
//!
//! ```ignore
//! manifest("small", "seed = 7")
//!     .generate("surfaces", "nodes = 32; hurst = 0.8; k_lower = 2; k_upper = 8")
//!     .solve("contact", "loads = [0.05, 0.1]; tolerance = 0.1")
//!     .measure("area", "")
//!     .text()
//! ```

/// Manifest of a study with a line for each key, as users write it.
pub struct Manifest {
    text: String,
    /// Name of the last stage, which the next one reads.
    last: String,
}

/// Begins the manifest of a study. `; ` separates the further `keys` of the table `[study]`, as all
/// keys below.
pub fn manifest(name: &str, keys: &str) -> Manifest {
    let text = format!("\n[study]\nname = \"{name}\"\n{}", lines(keys));
    Manifest { text, last: String::new() }
}

/// Begins a part of a manifest whose first stage reads the stage `from`.
pub fn stages_from(from: &str) -> Manifest {
    Manifest { text: String::new(), last: from.to_owned() }
}

/// Returns a line for each key. Texts are in single quotes.
fn lines(keys: &str) -> String {
    let keys = keys.split("; ").filter(|key| !key.is_empty());
    keys.map(|key| format!("{key}\n").replace('\'', "\"")).collect()
}

impl Manifest {
    pub fn generate(self, name: &str, keys: &str) -> Manifest {
        self.stage(name, "generate", keys)
    }

    pub fn solve(self, name: &str, keys: &str) -> Manifest {
        self.stage(name, "solve", keys)
    }

    pub fn measure(self, name: &str, keys: &str) -> Manifest {
        self.stage(name, "measure", keys)
    }

    pub fn correct(self, name: &str, keys: &str) -> Manifest {
        self.stage(name, "correct", keys)
    }

    pub fn fit(self, name: &str, keys: &str) -> Manifest {
        self.stage(name, "fit", keys)
    }

    pub fn aggregate(self, name: &str, keys: &str) -> Manifest {
        self.stage(name, "aggregate", keys)
    }

    /// Adds a stage, which reads the stage before it unless its keys begin with `from`.
    fn stage(mut self, name: &str, kind: &str, keys: &str) -> Manifest {
        self.text += &format!("\n[stage.{name}]\nkind = \"{kind}\"\n");
        if kind != "generate" && !keys.trim_start().starts_with("from = ") {
            self.text += &format!("from = \"{}\"\n", self.last);
        }
        self.text += &lines(keys);
        self.last = name.to_owned();
        self
    }

    /// Adds another table, such as `[parameters]` or `[figure.areas]`.
    pub fn table(mut self, name: &str, keys: &str) -> Manifest {
        self.text += &format!("\n[{name}]\n{}", lines(keys));
        self
    }

    pub fn text(self) -> String {
        self.text
    }
}
