//! The lines of a manifest that would add what a figure needs.

use super::figure_data::FigureData;
use asperity_stages::Kind;

impl FigureData<'_> {
    /// A stage under a name that the study does not use yet; `lines` follow its header.
    fn stage(&self, name: &str, lines: &str) -> String {
        let stages = &self.finished.plan.stages;
        let is_taken = |name: &str| stages.iter().any(|stage| stage.name == name);
        let mut free = name.to_owned();
        while is_taken(&free) {
            free += "-2";
        }
        format!("[stage.{free}]\n{lines}")
    }

    /// The name of the study's first stage of a kind, or what it would best be called.
    fn source(&self, kind: Kind, otherwise: &str) -> String {
        self.finished.name_of(kind).unwrap_or(otherwise).to_owned()
    }

    /// Solved and measured loads.
    pub fn lines_of_loads(&self, loads: &str) -> String {
        let surfaces = self.source(Kind::Generate, "surfaces");
        let solve = format!("kind = \"solve\"\nfrom = \"{surfaces}\"\nloads = {loads}\n\n");
        let measure = "kind = \"measure\"\nfrom = \"loads\"";
        self.stage("loads", &solve) + &self.stage("contacts", measure)
    }

    /// Corrected areas.
    pub fn lines_of_corrections(&self) -> String {
        let measured = self.source(Kind::Measure, "area");
        let lines = format!(
            "kind = \"correct\"\nfrom = \"{measured}\"\ncorrection = [\"none\", \"pi/8\", \"2017\"]"
        );
        self.stage("corrected", &lines)
    }

    /// A distribution of heights.
    pub fn lines_of_heights(&self) -> String {
        let surfaces = self.source(Kind::Generate, "surfaces");
        let lines = format!(
            "kind = \"measure\"\nfrom = \"{surfaces}\"\nbins = 1000\nrange = 5.0\npool = true"
        );
        self.stage("density", &lines)
    }

    /// Slopes by scale.
    pub fn lines_of_scales(&self) -> String {
        let surfaces = self.source(Kind::Generate, "surfaces");
        let lines = format!("kind = \"measure\"\nfrom = \"{surfaces}\"\nwhat = \"scales\"");
        self.stage("slopes", &lines)
    }

    /// Random surfaces.
    pub fn lines_of_surfaces(&self) -> String {
        let lines = "kind = \"generate\"\nnodes = 256\nhurst = 0.8\nk_lower = [1, 2, 4]\n\
                     k_upper = [8, 16, 32]\nrealizations = 50";
        self.stage("random-surfaces", lines)
    }

    /// The same surfaces on several meshes, and what their meshes add.
    pub fn lines_of_meshes(&self) -> String {
        let measured = self.source(Kind::Measure, "area");
        let lines = format!(
            "kind = \"fit\"            # with `nodes = [128, 256, 512]` in the stage of surfaces\n\
             from = \"{measured}\"\nlaw = \"mesh-convergence\""
        );
        self.stage("regression", &lines)
    }
}
