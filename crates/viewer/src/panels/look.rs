//! How panels look: themes, contrast, motion.

use crate::settings::Settings;
use egui::style::ScrollAnimation;
use egui::{Color32, Context, Id, Stroke, Style, Theme, Visuals};

/// What the style was last made of.
#[derive(Clone, Copy, PartialEq)]
struct Made {
    high_contrast: bool,
    reduced_motion: bool,
}

/// Makes styles of settings, where these have changed.
pub fn apply(ctx: &Context, settings: &Settings) {
    let key = Id::unique("style is made of");
    let made = Made { high_contrast: settings.high_contrast, reduced_motion: settings.reduced_motion };
    let before = ctx.data(|data| data.get_temp::<Made>(key));
    if before == Some(made) {
        return;
    }
    ctx.data_mut(|data| data.insert_temp(key, made));
    for theme in [Theme::Dark, Theme::Light] {
        let usual = theme.default_visuals();
        let visuals = if made.high_contrast { contrasting(usual) } else { usual };
        ctx.set_visuals_of(theme, visuals);
    }
    let usual = Style::default();
    ctx.all_styles_mut(|style| {
        style.animation_time = if made.reduced_motion { 0.0 } else { usual.animation_time };
        style.scroll_animation =
            if made.reduced_motion { ScrollAnimation::none() } else { usual.scroll_animation };
    });
    ctx.request_repaint();
}

/// Black and white, with borders around everything that can be used.
fn contrasting(mut visuals: Visuals) -> Visuals {
    let (ink, paper) = match visuals.dark_mode {
        true => (Color32::WHITE, Color32::BLACK),
        false => (Color32::BLACK, Color32::WHITE),
    };
    visuals.override_text_color = Some(ink);
    visuals.weak_text_color = Some(ink);
    (visuals.panel_fill, visuals.window_fill, visuals.extreme_bg_color) = (paper, paper, paper);
    visuals.window_stroke = Stroke::new(2.0, ink);
    let widgets = &mut visuals.widgets;
    for widget in [&mut widgets.inactive, &mut widgets.hovered, &mut widgets.active, &mut widgets.open] {
        widget.bg_stroke = Stroke::new(1.5, ink);
        widget.fg_stroke = Stroke::new(2.0, ink);
        (widget.bg_fill, widget.weak_bg_fill) = (paper, paper);
    }
    widgets.noninteractive.bg_stroke = Stroke::new(1.0, ink);
    // What is chosen is told by a border as well.
    visuals.selection.stroke = Stroke::new(2.0, ink);
    visuals
}
