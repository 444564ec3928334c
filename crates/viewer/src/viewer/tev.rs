//! Sending the picture to a running tev: when, and what is said of it.

use super::sending::Sending;
use super::state::Viewer;
use alhazen::TevAddress;
use std::sync::mpsc::TryRecvError;

/// A growing picture is sent at most so often, seconds.
const PAUSE: f64 = 0.5;

impl Viewer {
    /// Begins to send pictures to a tev.
    pub fn send_to_tev(&mut self, address: TevAddress) {
        let wake = self.wake.clone();
        self.sending = Some(Sending::start(address, move || wake()));
    }

    /// Whether the picture of the open scene is on its way, or has arrived.
    pub fn is_sent_to_tev(&self) -> bool {
        let sent = self.sending.as_ref().and_then(|sending| sending.sent);
        sent.is_some_and(|(shots, _)| shots == self.shots_seen)
    }

    /// Begins or ends sending pictures.
    pub(super) fn toggle_tev(&mut self) {
        match self.sending.take() {
            Some(sending) => self.notice(format!("tev at {} gets no more pictures", sending.address), false),
            None => {
                let address = self.tev_address.clone();
                self.notice(format!("looking for a tev at {address}"), false);
                self.send_to_tev(address);
            }
        }
    }

    /// Sends the newest picture, if the one before has arrived, and says what has become of that.
    pub(super) fn follow_tev(&mut self, ctx: &egui::Context) {
        let Some(sending) = &mut self.sending else { return };
        let end = match sending.answers.try_recv() {
            Ok(Ok(())) => {
                sending.is_busy = false;
                let is_first = !std::mem::replace(&mut sending.arrived, true);
                is_first.then(|| (format!("tev at {} shows the picture", sending.address), false))
            }
            Ok(Err(text)) => Some((text, true)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(("the connection to tev has ended".to_owned(), true)),
        };
        if let Some((text, is_error)) = end {
            self.notice(text, is_error);
            if is_error {
                self.sending = None;
                return;
            }
        }
        let name =
            format!("alhazen: {}", self.document.as_ref().map_or(String::new(), |d| d.source.to_string()));
        let (shots, time) = (self.shots_seen, self.time);
        let shot = self.shots[0].as_ref().filter(|s| !s.preview && s.generation == self.generation);
        let (Some(sending), Some(shot)) = (&mut self.sending, shot) else { return };
        let is_new = sending.sent.is_none_or(|(sent, _)| sent != shots);
        let wait = sending.sent.map_or(0.0, |(_, when)| when + PAUSE - time);
        if !is_new || sending.is_busy {
            return;
        }
        if wait > 0.0 {
            ctx.request_repaint_after(std::time::Duration::from_secs_f64(wait));
            return;
        }
        sending.is_busy = sending.pictures.send((name, shot.linear.clone())).is_ok();
        sending.sent = Some((shots, time));
    }
}
