//! Pictures on their way to a running tev, from a thread of their own: neither the window nor rendering waits for it.

use crate::worker::full_text;
use alhazen::{Image, Tev, TevAddress};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

/// Pictures on their way to a tev.
pub(super) struct Sending {
    pub(super) address: TevAddress,
    pub(super) pictures: Sender<(String, Arc<Image>)>,
    /// A picture has arrived, or why none does.
    pub(super) answers: Receiver<Result<(), String>>,
    pub(super) is_busy: bool,
    /// Pictures that had come from the render thread when the last one was sent, and when that was.
    pub(super) sent: Option<(u64, f64)>,
    /// Whether tev has got any.
    pub(super) arrived: bool,
}

impl Sending {
    pub(super) fn start(address: TevAddress, wake: impl Fn() + Send + 'static) -> Self {
        let (pictures, inbox) = channel();
        let (outbox, answers) = channel();
        let place = address.clone();
        let work = move || {
            let told = run(&place, &inbox, &outbox, &wake).map_err(|error| full_text(&error));
            if told.is_err() {
                let _ = outbox.send(told);
                wake();
            }
        };
        // Without a thread the channel is closed, which is told as the end of the connection.
        let _ = std::thread::Builder::new().name("tev".into()).spawn(work);
        Self { address, pictures, answers, is_busy: false, sent: None, arrived: false }
    }
}

/// Sends pictures until nobody has any more. What another scene was called is closed.
fn run(
    address: &TevAddress,
    inbox: &Receiver<(String, Arc<Image>)>,
    outbox: &Sender<Result<(), String>>,
    wake: &impl Fn(),
) -> Result<(), alhazen::TevError> {
    let mut tev = Tev::connect(address)?;
    let mut last: Option<String> = None;
    while let Ok((name, image)) = inbox.recv() {
        if let Some(other) = last.replace(name.clone()).filter(|last| *last != name) {
            tev.close(&other)?;
        }
        tev.show_image(&name, &image)?;
        let _ = outbox.send(Ok(()));
        wake();
    }
    Ok(())
}
