//! The commands of menus, keys, the command palette and scripts: their names and keys.

use egui::{Key, KeyboardShortcut, Modifiers};

/// Something that can be done without saying more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the list below says what each does")]
pub enum Command {
    Open,
    Reload,
    Save,
    SaveAs,
    Screenshot,
    SavePicture,
    CopyCommandLine,
    CancelLoading,
    Quit,
    Undo,
    Redo,
    SelectArea,
    CopyMaterial,
    PasteMaterial,
    Duplicate,
    Delete,
    ShowAll,
    Hide,
    Isolate,
    Rename,
    AddModel,
    AddLamp,
    AddPointLight,
    Deselect,
    Frame,
    Home,
    ToggleProjection,
    Play,
    PlayTime,
    StepOn,
    StepBack,
    Rest,
    KeepView,
    ResetZoom,
    FullScreen,
    SidePanel,
    Palette,
    Help,
    Pause,
    Restart,
    NextLayer,
    Picture,
    CompareSettings,
    CompareNow,
    CompareFile,
    CompareNothing,
    Snapshot,
    NextLook,
    Zebra,
    PixelGrid,
    CopyPicture,
    SendToTev,
    CropArea,
    CropNothing,
    Brighter,
    Darker,
    PresetDraft,
    PresetPreview,
    PresetFinal,
    RenderToFile,
    RecordTurntable,
    RecordPath,
    RecordOrbit,
    StopRecording,
    ToolSelect,
    ToolMove,
    ToolRotate,
    ToolScale,
    LocalAxes,
    Aim,
    Icons,
    Compass,
    Ground,
    ExportStatistics,
}

/// A command as users see it.
pub struct CommandInfo {
    /// The command.
    pub command: Command,
    /// What it does.
    pub name: &'static str,
    /// Its keys.
    pub keys: Option<KeyboardShortcut>,
}

impl CommandInfo {
    /// Its keys as they are written on keyboards: `Ctrl+S`, `]`. Empty without any.
    pub fn shortcut_text(&self, ctx: &egui::Context) -> String {
        let Some(keys) = self.keys else { return String::new() };
        let (name, symbol) = (keys.logical_key.name(), keys.logical_key.symbol_or_name());
        let text = ctx.format_shortcut(&keys);
        text.strip_suffix(name).map_or(text.clone(), |modifiers| format!("{modifiers}{symbol}"))
    }
}

const fn key(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::NONE, key))
}

const fn command(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::COMMAND, key))
}

const fn alt(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::ALT, key))
}

const fn shift_command(key: Key) -> Option<KeyboardShortcut> {
    Some(KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), key))
}

const fn info(command: Command, name: &'static str, keys: Option<KeyboardShortcut>) -> CommandInfo {
    CommandInfo { command, name, keys }
}

/// All commands, in the order of the palette. Of two with the same key the one with more modifiers comes first.
pub const COMMANDS: &[CommandInfo] = &[
    info(Command::Open, "Open a scene…", command(Key::O)),
    info(Command::Reload, "Reload the file", command(Key::R)),
    info(Command::SaveAs, "Save the scene as…", shift_command(Key::S)),
    info(Command::Save, "Save the scene", command(Key::S)),
    info(Command::RenderToFile, "Render to a file…", command(Key::F12)),
    info(Command::Screenshot, "Save a screenshot (PNG)…", key(Key::F12)),
    info(Command::SavePicture, "Save the rendered picture (EXR)…", command(Key::E)),
    info(Command::CopyCommandLine, "Copy the command line that renders this", None),
    info(Command::CancelLoading, "Stop loading", None),
    info(Command::Redo, "Redo", shift_command(Key::Z)),
    info(Command::Undo, "Undo", command(Key::Z)),
    info(Command::Duplicate, "Duplicate the object", command(Key::D)),
    info(Command::PasteMaterial, "Give the selection the copied material", command(Key::V)),
    info(Command::Delete, "Delete the selection", key(Key::Delete)),
    info(Command::ShowAll, "Show all objects", alt(Key::H)),
    info(Command::Hide, "Hide or show the selection", key(Key::H)),
    info(Command::Isolate, "Show only the selection", key(Key::Slash)),
    info(Command::Rename, "Rename the selection", key(Key::F2)),
    info(Command::ToolSelect, "Select without handles", key(Key::Num1)),
    info(Command::ToolMove, "Move the selection by handles", key(Key::Num2)),
    info(Command::ToolRotate, "Rotate the selection by handles", key(Key::Num3)),
    info(Command::ToolScale, "Scale the selection by handles", key(Key::Num4)),
    info(Command::LocalAxes, "Axes of the object or of the world", key(Key::X)),
    info(Command::Aim, "Aim the light: click where it should fall", key(Key::J)),
    info(Command::Icons, "Show or hide the signs of lights and cameras", key(Key::I)),
    info(Command::Compass, "Show or hide the compass of axes", None),
    info(Command::Ground, "Show or hide the ground grid", command(Key::G)),
    info(Command::AddModel, "Add a model…", None),
    info(Command::AddLamp, "Add a sphere light", None),
    info(Command::AddPointLight, "Add a point light", None),
    info(Command::Deselect, "Close what is on top, or deselect", key(Key::Escape)),
    info(Command::Frame, "Frame the selected object, or everything", key(Key::F)),
    info(Command::Home, "Go to the first camera", key(Key::Home)),
    info(Command::ToggleProjection, "Perspective or orthographic", key(Key::Num5)),
    info(Command::Play, "Automatic orbit", key(Key::O)),
    info(Command::PlayTime, "Play or pause the animation", key(Key::T)),
    info(Command::StepOn, "Next frame", key(Key::Period)),
    info(Command::StepBack, "Previous frame", key(Key::Comma)),
    info(Command::Rest, "Show the rest pose", None),
    info(Command::KeepView, "Save this view", command(Key::B)),
    info(Command::ResetZoom, "Fit the picture into the window", key(Key::Num0)),
    info(Command::FullScreen, "Full screen", key(Key::F11)),
    info(Command::SidePanel, "Show or hide the panels", key(Key::N)),
    info(Command::Palette, "All commands…", command(Key::P)),
    info(Command::Help, "Mouse and keys", key(Key::F1)),
    info(Command::Pause, "Pause or resume rendering", key(Key::Space)),
    info(Command::Restart, "Restart rendering", None),
    info(Command::NextLayer, "Show the next layer", key(Key::L)),
    info(Command::Picture, "Show the picture", key(Key::P)),
    info(Command::CopyPicture, "Copy the picture to the clipboard", shift_command(Key::C)),
    info(Command::SendToTev, "Send pictures to tev, or no more", None),
    info(Command::CopyMaterial, "Copy the material of the selected object", command(Key::C)),
    info(Command::CropNothing, "Reset the crop: render the whole picture", alt(Key::M)),
    info(Command::CropArea, "Crop: drag a rectangle to render only that", key(Key::M)),
    info(Command::SelectArea, "Select what is in a rectangle: drag it", key(Key::B)),
    info(Command::CompareSettings, "Compare two settings", None),
    info(Command::CompareNow, "Compare with the current picture", key(Key::C)),
    info(Command::CompareFile, "Compare with a file…", None),
    info(Command::CompareNothing, "End the comparison", None),
    info(Command::Snapshot, "Keep the picture as a snapshot", key(Key::K)),
    info(Command::NextLook, "Show A and B, A, B, or their difference", key(Key::V)),
    info(Command::Zebra, "Zebra stripes over what is clipped", key(Key::Z)),
    info(Command::PixelGrid, "Borders and values of large pixels", key(Key::G)),
    info(Command::Brighter, "Brighter: exposure up by half a stop", key(Key::CloseBracket)),
    info(Command::Darker, "Darker: exposure down by half a stop", key(Key::OpenBracket)),
    info(Command::PresetDraft, "Quality: draft", None),
    info(Command::PresetPreview, "Quality: preview", None),
    info(Command::PresetFinal, "Quality: final", None),
    info(Command::RecordTurntable, "Record a turntable…", None),
    info(Command::RecordPath, "Record a path through the saved views…", None),
    info(Command::RecordOrbit, "Record the camera orbit…", None),
    info(Command::StopRecording, "Stop rendering to a file", None),
    info(Command::ExportStatistics, "Export measurements (CSV, JSON)…", None),
    info(Command::Quit, "Quit", command(Key::Q)),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_is_in_the_list_once_and_keys_are_unique() {
        for (i, a) in COMMANDS.iter().enumerate() {
            for b in &COMMANDS[..i] {
                assert!(a.command != b.command && a.name != b.name, "{}", a.name);
                assert!(a.keys.is_none() || a.keys != b.keys, "{} and {}", a.name, b.name);
            }
        }
        assert_eq!(COMMANDS.len(), Command::ExportStatistics as usize + 1);
    }

    #[test]
    fn shortcuts_read_as_keyboards_do() {
        let ctx = egui::Context::default();
        let text = |command: Command| {
            let info = COMMANDS.iter().find(|info| info.command == command).expect("listed");
            info.shortcut_text(&ctx)
        };
        assert_eq!([text(Command::Brighter), text(Command::StepOn)], ["]", "."]);
        assert!(text(Command::SaveAs).ends_with("S") && text(Command::SaveAs).len() > 1);
        assert_eq!(text(Command::AddModel), "");
    }

    #[test]
    fn longer_shortcuts_come_before_shorter_ones() {
        // egui takes a shortcut even when more modifiers are held than it asks for.
        for (i, a) in COMMANDS.iter().enumerate() {
            for b in &COMMANDS[i + 1..] {
                if let (Some(a), Some(b)) = (a.keys, b.keys)
                    && a.logical_key == b.logical_key
                {
                    assert!(a.modifiers.contains(b.modifiers), "{a:?} hides {b:?}");
                }
            }
        }
    }
}
