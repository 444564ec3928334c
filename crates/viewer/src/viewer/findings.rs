//! Image tools at work: what is asked of pictures, and what was found.

use super::compare::Comparison;
use super::state::Viewer;
use super::tools::{Asked, Look};
use crate::analysis::{Request, Wanted};
use crate::panels::Tab;
use alhazen::Image;
use egui::{Context, TextureOptions};
use std::sync::Arc;

/// So many times as long as looking into a picture takes is waited before the next one is looked
/// into: most of the time belongs to rendering.
const PATIENCE: f64 = 4.0;

impl Viewer {
    /// What the picture is compared with, linear; `None` while there is nothing or it is not there yet.
    pub fn reference(&self) -> Option<Arc<Image>> {
        match &self.comparison {
            Comparison::None => None,
            Comparison::Settings { .. } => {
                self.shots[1].as_ref().filter(|shot| !shot.preview).map(|shot| shot.linear.clone())
            }
            Comparison::Stored { image, .. } => Some(image.clone()),
        }
    }

    fn wanted(&self) -> Wanted {
        let compares = self.comparison.split().is_some();
        let page = self.open.side && self.open.tab == Tab::Image;
        let shows = self.tools.look == Look::Difference;
        Wanted {
            distribution: page,
            clipping: self.tools.zebra,
            difference: (compares && (page || shows)).then_some(self.tools.difference),
        }
    }

    /// Has the newest picture looked into, if anybody wants to know.
    pub(super) fn ask_for_findings(&mut self, ctx: &Context) {
        let wanted = self.wanted();
        if wanted == Wanted::default() {
            (self.tools.findings, self.tools.asked) = (None, None);
            return;
        }
        let Some(shot) = self.shots[0].as_ref().filter(|shot| !shot.preview) else { return };
        let reference = self.reference().filter(|_| wanted.difference.is_some());
        let asked = Asked {
            shots: self.shots_seen,
            exposure: self.shown.tone.exposure,
            wanted,
            reference: reference.as_ref().map(|image| Arc::as_ptr(image) as usize),
        };
        let before = self.tools.asked;
        if self.tools.waits || before == Some(asked) {
            return;
        }
        // Another question is answered at once; the same one about a newer picture has time.
        let is_new = before.is_none_or(|before| Asked { shots: asked.shots, ..before } != asked);
        if !is_new && self.time < self.tools.not_before {
            let wait = self.tools.not_before - self.time;
            ctx.request_repaint_after(std::time::Duration::from_secs_f64(wait));
            return;
        }
        self.tools.number += 1;
        self.analyst.ask(Request {
            number: self.tools.number,
            linear: shot.linear.clone(),
            shown: shot.image.clone(),
            reference,
            is_encoded: matches!(self.comparison, Comparison::Stored { encoded: true, .. }),
            exposure: asked.exposure,
            wanted,
        });
        (self.tools.asked, self.tools.waits) = (Some(asked), true);
    }

    /// Takes what was found.
    pub(super) fn take_findings(&mut self, ctx: &Context) {
        let Some(findings) = self.analyst.take() else { return };
        let tools = &mut self.tools;
        (tools.waits, tools.not_before) = (false, self.time + PATIENCE * findings.took.as_secs_f64());
        let texture = |name: &str, image: &egui::ColorImage, options| {
            Some(ctx.load_texture(name, image.clone(), options))
        };
        let (sharp, smooth) = (TextureOptions::NEAREST, TextureOptions::LINEAR);
        tools.waveform = findings.waveform.as_ref().and_then(|image| texture("waveform", image, smooth));
        tools.stripes = findings.clipping.as_ref().and_then(|c| texture("zebra", &c.stripes, sharp));
        let compared = findings.compared.as_ref().and_then(|compared| compared.as_ref().ok());
        tools.error_map = compared.and_then(|c| texture("difference", &c.picture, sharp));
        tools.findings = Some(findings);
    }

    /// Shows the next of A, B and both; says so.
    pub(super) fn next_look(&mut self) {
        if self.comparison.split().is_none() {
            return self
                .notice("nothing to compare with: take a snapshot (K), or compare with a file", false);
        }
        let after = Look::ALL.into_iter().skip_while(|look| *look != self.tools.look).nth(1);
        self.tools.look = after.unwrap_or_default();
        self.notice(format!("shown: {}", self.tools.look.name()), false);
    }

    pub(super) fn toggle_zebra(&mut self) {
        self.tools.zebra = !self.tools.zebra;
        let text = match self.tools.zebra {
            true => "zebra: red stripes are at the greatest display value, blue ones are black",
            false => "no zebra",
        };
        self.notice(text, false);
    }

    pub(super) fn toggle_grid(&mut self) {
        self.settings.pixel_grid = !self.settings.pixel_grid;
        let text = match self.settings.pixel_grid {
            true => "pixels that are large enough have borders and values: zoom in with Ctrl and the wheel",
            false => "pixels have no borders and values",
        };
        self.notice(text, false);
    }

    /// Puts the picture as it is shown on the clipboard.
    pub(super) fn copy_picture(&mut self, ctx: &Context) {
        let Some(shot) = self.shot() else {
            return self.notice("there is no picture to copy yet", false);
        };
        let image = shot.image.as_ref().clone();
        let [width, height] = image.size;
        ctx.copy_image(image);
        self.notice(format!("copied the picture, {width}×{height}"), false);
    }
}
