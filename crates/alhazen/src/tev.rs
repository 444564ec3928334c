//! Sending pictures to a running [tev](https://github.com/Tom94/tev) over its TCP protocol.
//!
//! A packet is its own length in bytes (u32), a byte that says what it is, and what belongs to that; numbers are little
//! endian, texts end with a zero (tev's README, "Over the Network", and its `Ipc.cpp`). tev answers nothing.

use film::{ExrFile, ExrSamples, Film, Image, Precision, Rect};
use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// Where tev listens unless it is told otherwise.
const PORT: u16 = 14158;
/// So long is waited for somebody who answers, and for somebody who takes what is sent.
const PATIENCE: [Duration; 2] = [Duration::from_secs(3), Duration::from_secs(10)];
/// A packet has at most so many bytes of pixels: larger pictures are sent in bands of rows.
const BAND: usize = 1 << 24;

/// What packets are.
const CLOSE_IMAGE: u8 = 2;
const CREATE_IMAGE: u8 = 4;
/// With any number of channels, and where in the data each one's values are.
const UPDATE_IMAGE: u8 = 6;

/// Why pictures do not come to tev.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TevError {
    /// Nobody is there.
    #[error("no tev listens at {address}: start it, or say its `--host` to Alhazen")]
    Connect {
        /// HOST:PORT.
        address: String,
        /// What the system says.
        source: io::Error,
    },
    /// The connection ended, or tev takes nothing any more.
    #[error("tev at {address} takes no more pictures")]
    Send {
        /// HOST:PORT.
        address: String,
        /// What the system says.
        source: io::Error,
    },
}

/// HOST:PORT of a tev.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TevAddress(String);

impl Default for TevAddress {
    /// Where tev listens on this machine unless it is told otherwise.
    fn default() -> Self {
        Self(format!("127.0.0.1:{PORT}"))
    }
}

impl std::fmt::Display for TevAddress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

/// A text that is no HOST:PORT.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not HOST:PORT, such as 127.0.0.1:14158")]
pub struct UnknownTevAddress(String);

impl std::str::FromStr for TevAddress {
    type Err = UnknownTevAddress;

    /// Without a port it is tev's usual one.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (host, port) = match text.rsplit_once(':') {
            // The colons of an IPv6 address are between brackets.
            Some((host, port)) if !port.ends_with(']') => (host, port.parse().ok()),
            _ => (text, Some(PORT)),
        };
        match port {
            Some(port) if !host.is_empty() => Ok(Self(format!("{host}:{port}"))),
            _ => Err(UnknownTevAddress(text.to_owned())),
        }
    }
}

/// A channel of a picture: its name, such as `R` or `normal.X`, and its values row by row from the top.
pub type TevChannel<'a> = (&'a str, &'a [f32]);

/// A connection to a tev.
#[derive(Debug)]
pub struct Tev {
    stream: TcpStream,
    address: TevAddress,
    /// Name, size and channels of the picture that tev was last told to make room for.
    made: Option<(String, [u32; 2], Vec<String>)>,
}

impl Tev {
    /// Connects; this takes at most some seconds.
    ///
    /// # Errors
    /// [`TevError::Connect`].
    pub fn connect(address: &TevAddress) -> Result<Self, TevError> {
        let failed = |source| TevError::Connect { address: address.0.clone(), source };
        let mut last = io::Error::new(io::ErrorKind::NotFound, "the host has no address");
        for place in address.0.to_socket_addrs().map_err(failed)? {
            match TcpStream::connect_timeout(&place, PATIENCE[0]) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(PATIENCE[1])).map_err(failed)?;
                    return Ok(Self { stream, address: address.clone(), made: None });
                }
                Err(error) => last = error,
            }
        }
        Err(failed(last))
    }

    /// Shows a picture of `width`×`height` pixels, or what is new of the one that has this name.
    ///
    /// - `window`: where the values of `channels` lie in it.
    ///
    /// # Errors
    /// [`TevError::Send`].
    pub fn show(
        &mut self,
        name: &str,
        size: [u32; 2],
        window: Rect,
        channels: &[TevChannel<'_>],
    ) -> Result<(), TevError> {
        let names: Vec<String> = channels.iter().map(|(name, _)| (*name).to_owned()).collect();
        let made = Some((name.to_owned(), size, names));
        if self.made != made {
            self.send(&create(name, size, channels))?;
            self.made = made;
        }
        let columns = window.width as usize;
        let rows = (BAND / (4 * columns * channels.len()).max(1)).max(1);
        for first in (0..window.height as usize).step_by(rows) {
            let count = rows.min(window.height as usize - first);
            let band = Rect { y: window.y + first as u32, height: count as u32, ..window };
            let cut = |(_, values): &TevChannel<'_>| {
                values.get(first * columns..(first + count) * columns).unwrap_or_default().to_vec()
            };
            let values: Vec<Vec<f32>> = channels.iter().map(cut).collect();
            self.send(&update(name, band, channels, &values))?;
        }
        Ok(())
    }

    /// Shows a film with all its layers.
    ///
    /// - `colour`: takes the place of the film's own, such as without its noise.
    ///
    /// # Errors
    /// [`TevError::Send`].
    pub fn show_film(&mut self, name: &str, film: &Film, colour: Option<&Image>) -> Result<(), TevError> {
        let mut file = ExrFile::new(film.width(), film.height(), film.window());
        file.push_colour(colour.unwrap_or(&film.to_image()), Precision::Float);
        file.push_aovs(film);
        let values = |samples: &ExrSamples| match samples {
            ExrSamples::Half(values) | ExrSamples::Float(values) => values.clone(),
            ExrSamples::Uint(ids) => ids.iter().map(|id| *id as f32).collect(),
        };
        let values: Vec<Vec<f32>> = file.channels.iter().map(|channel| values(&channel.samples)).collect();
        let names = file.channels.iter().map(|channel| channel.name.as_str());
        let channels: Vec<TevChannel<'_>> = names.zip(values.iter().map(Vec::as_slice)).collect();
        self.show(name, [film.width(), film.height()], film.window(), &channels)
    }

    /// Shows a picture of three channels.
    ///
    /// # Errors
    /// [`TevError::Send`].
    pub fn show_image(&mut self, name: &str, image: &Image) -> Result<(), TevError> {
        let n = image.channels();
        let channel = |c: usize| image.data().iter().skip(c).step_by(n).copied().collect();
        let values: Vec<Vec<f32>> = (0..n.min(3)).map(channel).collect();
        let channels: Vec<TevChannel<'_>> =
            ["R", "G", "B"].into_iter().zip(values.iter().map(Vec::as_slice)).collect();
        let size = [image.width(), image.height()];
        self.show(name, size, Rect::full(size[0], size[1]), &channels)
    }

    /// Has tev close a picture.
    ///
    /// # Errors
    /// [`TevError::Send`].
    pub fn close(&mut self, name: &str) -> Result<(), TevError> {
        self.made = None;
        let mut packet = Packet::new(CLOSE_IMAGE);
        packet.text(name);
        self.send(&packet)
    }

    fn send(&mut self, packet: &Packet) -> Result<(), TevError> {
        let failed = |source| TevError::Send { address: self.address.0.clone(), source };
        let length = u32::try_from(packet.0.len() + 4).map_err(|_| {
            failed(io::Error::new(io::ErrorKind::InvalidInput, "the picture's rows are too long"))
        })?;
        self.stream
            .write_all(&length.to_le_bytes())
            .and_then(|()| self.stream.write_all(&packet.0))
            .map_err(failed)
    }
}

/// A packet that makes room for a picture; one of that name is replaced.
fn create(name: &str, size: [u32; 2], channels: &[TevChannel<'_>]) -> Packet {
    let mut packet = Packet::new(CREATE_IMAGE);
    // Whether tev shows it at once.
    packet.0.push(1);
    packet.text(name);
    size.into_iter().for_each(|side| packet.number(side));
    packet.number(channels.len() as u32);
    channels.iter().for_each(|(channel, _)| packet.text(channel));
    packet
}

/// A packet that replaces pixels of a picture. One channel's values follow the other's.
fn update(name: &str, window: Rect, channels: &[TevChannel<'_>], values: &[Vec<f32>]) -> Packet {
    let pixels = window.area();
    let mut packet = Packet::new(UPDATE_IMAGE);
    packet.0.reserve(4 * pixels * channels.len() + 256);
    // What is looked at stays in front.
    packet.0.push(0);
    packet.text(name);
    packet.number(channels.len() as u32);
    channels.iter().for_each(|(channel, _)| packet.text(channel));
    [window.x, window.y, window.width, window.height].into_iter().for_each(|v| packet.number(v));
    // Where a channel's values begin, and how far they are apart.
    (0..channels.len()).for_each(|channel| packet.long((channel * pixels) as u64));
    channels.iter().for_each(|_| packet.long(1));
    values.iter().flatten().for_each(|value| packet.0.extend(value.to_le_bytes()));
    packet
}

/// What comes after the length.
struct Packet(Vec<u8>);

impl Packet {
    fn new(kind: u8) -> Self {
        Self(vec![kind])
    }

    /// A zero within would end it: names of files may have none, others are cut there.
    fn text(&mut self, text: &str) {
        self.0.extend(text.bytes().take_while(|byte| *byte != 0));
        self.0.push(0);
    }

    fn number(&mut self, number: u32) {
        self.0.extend(number.to_le_bytes());
    }

    fn long(&mut self, number: u64) {
        self.0.extend(number.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::net::TcpListener;

    /// Takes packets apart as tev's `Ipc.cpp` does.
    struct Reader<'a>(&'a [u8]);

    impl Reader<'_> {
        fn take<const N: usize>(&mut self) -> [u8; N] {
            let (head, rest) = self.0.split_at(N);
            self.0 = rest;
            head.try_into().expect("as long")
        }

        fn number(&mut self) -> i32 {
            i32::from_le_bytes(self.take())
        }

        fn text(&mut self) -> String {
            let end = self.0.iter().position(|byte| *byte == 0).expect("a zero ends it");
            let text = String::from_utf8(self.0[..end].to_vec()).expect("UTF-8");
            self.0 = &self.0[end + 1..];
            text
        }
    }

    /// What a listener was sent, until the connection ended: packets without their lengths.
    fn listen() -> (TevAddress, std::thread::JoinHandle<Vec<Vec<u8>>>) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("bound").to_string().parse().expect("an address");
        let thread = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("somebody comes");
            let mut all = Vec::new();
            stream.read_to_end(&mut all).expect("all of it");
            let (mut rest, mut packets) = (&all[..], Vec::new());
            while !rest.is_empty() {
                let length = u32::from_le_bytes(rest[..4].try_into().expect("four")) as usize;
                packets.push(rest[4..length].to_vec());
                rest = &rest[length..];
            }
            packets
        });
        (address, thread)
    }

    #[test]
    fn pictures_arrive_as_tev_reads_them() {
        let (address, thread) = listen();
        // Two bands.
        let (width, height) = (1024, 1500);
        let image = Image::from_fn(width, height, |x, y| [x as f32, y as f32, 0.5]);
        let mut tev = Tev::connect(&address).expect("it listens");
        tev.show_image("alhazen", &image).expect("sent");
        tev.show_image("alhazen", &image).expect("sent");
        tev.close("alhazen").expect("sent");
        drop(tev);
        let packets = thread.join().expect("read");
        assert_eq!(packets.iter().map(|packet| packet[0]).collect::<Vec<_>>(), [4, 6, 6, 6, 6, 2]);
        let mut created = Reader(&packets[0][1..]);
        assert_eq!((created.take(), created.text().as_str()), ([1], "alhazen"));
        assert_eq!([created.number(), created.number(), created.number()], [1024, 1500, 3]);
        assert_eq!([created.text(), created.text(), created.text()].concat(), "RGB");
        assert!(created.0.is_empty());
        let mut rows = 0;
        for packet in &packets[1..3] {
            let mut update = Reader(&packet[1..]);
            assert_eq!((update.take(), update.text().as_str(), update.number()), ([0], "alhazen", 3));
            assert_eq!([update.text(), update.text(), update.text()].concat(), "RGB");
            let [x, y, across, down] = [(); 4].map(|()| update.number());
            assert_eq!((x, y, across), (0, rows, 1024));
            rows += down;
            let pixels = (across * down) as usize;
            let offsets = [(); 3].map(|()| i64::from_le_bytes(update.take()) as usize);
            let strides = [(); 3].map(|()| i64::from_le_bytes(update.take()) as usize);
            let last = offsets[2] + (pixels - 1) * strides[2] + 1;
            assert_eq!(update.0.len(), 4 * last, "as many values as tev expects");
            let value = |channel: usize, i: usize| {
                let at = 4 * (offsets[channel] + i * strides[channel]);
                f32::from_le_bytes(update.0[at..at + 4].try_into().expect("four"))
            };
            let i = 1024 * 3 + 17;
            assert_eq!([value(0, i), value(1, i), value(2, i)], [17.0, (y + 3) as f32, 0.5]);
        }
        assert_eq!(rows, 1500);
        assert_eq!(Reader(&packets[5][1..]).text(), "alhazen");
    }

    #[test]
    fn films_have_all_their_layers_and_their_place() {
        let (address, thread) = listen();
        let window = Rect { x: 2, y: 1, width: 3, height: 2 };
        let mut film = Film::with_window(8, 4, window, &[film::Aov::SampleCount]).expect("small");
        assert!(film.add(3, 2, [0.25, 0.5, 4.0]));
        Tev::connect(&address).and_then(|mut tev| tev.show_film("part", &film, None)).expect("sent");
        let packets = thread.join().expect("read");
        let mut created = Reader(&packets[0][2..]);
        assert_eq!(created.text(), "part");
        let [width, height, count] = [(); 3].map(|()| created.number());
        assert_eq!((width, height), (8, 4));
        let names: Vec<String> = (0..count).map(|_| created.text()).collect();
        assert!(["R", "G", "B"].iter().all(|name| names.iter().any(|n| n == name)), "{names:?}");
        assert!(names.len() > 3, "{names:?}");
        let mut update = Reader(&packets[1][2..]);
        let (_, count) = (update.text(), update.number());
        (0..count).for_each(|_| drop(update.text()));
        assert_eq!([(); 4].map(|()| update.number()), [2, 1, 3, 2]);
    }

    #[test]
    fn without_a_tev_there_is_a_message_at_once() {
        // A port that was free a moment ago.
        let free = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a port");
        let begun = std::time::Instant::now();
        let error = Tev::connect(&free.to_string().parse().expect("an address")).expect_err("nobody listens");
        assert!(error.to_string().contains(&format!("no tev listens at {free}")), "{error}");
        assert!(begun.elapsed() < PATIENCE[0] + Duration::from_secs(1));
    }

    #[test]
    fn addresses_are_read_and_have_a_port() {
        let read = |text: &str| text.parse::<TevAddress>().map(|address| address.to_string());
        assert_eq!(read("10.0.0.7:99"), Ok("10.0.0.7:99".into()));
        assert_eq!(read("render.local"), Ok("render.local:14158".into()));
        assert_eq!(read("[::1]"), Ok("[::1]:14158".into()));
        assert_eq!(read("[::1]:7"), Ok("[::1]:7".into()));
        assert_eq!(TevAddress::default().to_string(), "127.0.0.1:14158");
        for wrong in ["", ":14158", "host:", "host:99999", "host:port"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
