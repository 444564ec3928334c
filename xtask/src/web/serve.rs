//! A server of a folder for browsers on this machine.

use anyhow::Context;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// What a page sends is no larger than this, bytes.
const LARGEST: u64 = 64 << 20;

/// No page waits longer.
const LONGEST_WAIT: Duration = Duration::from_secs(60);

/// What pages have sent, by the name that they gave it.
#[derive(Default)]
struct Received {
    files: Mutex<BTreeMap<String, Vec<u8>>>,
    more: Condvar,
}

/// Serves a folder; what is sent to `/sent/NAME` is kept. Its threads end with the program.
pub struct Server {
    port: u16,
    received: Arc<Received>,
    thread: std::thread::JoinHandle<()>,
}

impl Server {
    /// Begins to serve `folder` at a port of the loopback device; 0 takes any that is free.
    pub fn start(folder: &Path, port: u16) -> anyhow::Result<Self> {
        let listener =
            TcpListener::bind((Ipv4Addr::LOCALHOST, port)).with_context(|| format!("port {port}"))?;
        let port = listener.local_addr()?.port();
        let received = Arc::new(Received::default());
        let (folder, shared) = (folder.to_owned(), received.clone());
        let thread = std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (folder, shared) = (folder.clone(), shared.clone());
                // A browser that has gone away is no fault.
                std::thread::spawn(move || drop(answer(stream, &folder, &shared)));
            }
        });
        Ok(Self { port, received, thread })
    }

    /// Where it is.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/", self.port)
    }

    /// Serves until the program is ended.
    pub fn wait(self) {
        let _ = self.thread.join();
    }

    /// Waits for a page to send something of this name.
    pub fn receive(&self, name: &str, limit: Duration) -> anyhow::Result<Vec<u8>> {
        let files = self.received.files.lock().unwrap_or_else(PoisonError::into_inner);
        let waits = |files: &mut BTreeMap<String, Vec<u8>>| !files.contains_key(name);
        let waited = self.received.more.wait_timeout_while(files, limit, waits);
        let (mut files, _) = waited.unwrap_or_else(PoisonError::into_inner);
        files.remove(name).with_context(|| format!("the page sent no {name} within {} s", limit.as_secs()))
    }
}

fn answer(mut stream: TcpStream, folder: &Path, received: &Received) -> std::io::Result<()> {
    let mut reader = BufReader::new(stream.try_clone()?);
    let mut line = String::new();
    reader.read_line(&mut line)?;
    let mut words = line.split_whitespace();
    let (method, target) = (words.next().unwrap_or(""), words.next().unwrap_or("/"));
    let path = target.split(['?', '#']).next().unwrap_or("/").trim_start_matches('/').to_owned();
    let mut length = 0;
    loop {
        let mut header = String::new();
        if reader.read_line(&mut header)? == 0 || header.trim().is_empty() {
            break;
        }
        if let Some((name, value)) = header.split_once(':')
            && name.eq_ignore_ascii_case("content-length")
        {
            length = value.trim().parse().unwrap_or(0);
        }
    }
    if let ("POST", Some(name)) = (method, path.strip_prefix("sent/")) {
        let mut bytes = Vec::new();
        reader.take(length.min(LARGEST)).read_to_end(&mut bytes)?;
        received.files.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned(), bytes);
        received.more.notify_all();
        return stream.write_all(b"HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n");
    }
    if let Some(seconds) = path.strip_prefix("wait/").and_then(|s| s.parse().ok()) {
        // For pages that are not to be complete before.
        std::thread::sleep(Duration::from_secs(seconds).min(LONGEST_WAIT));
    }
    match file(folder, &path).and_then(|file| Some((std::fs::read(&file).ok()?, content_type(&file)))) {
        Some((bytes, kind)) => {
            write!(
                stream,
                "HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nCache-Control: no-cache\r\n\
                 Cross-Origin-Opener-Policy: same-origin\r\nCross-Origin-Embedder-Policy: require-corp\r\n\
                 Connection: close\r\n\r\n",
                bytes.len()
            )?;
            stream.write_all(&bytes)
        }
        None => stream.write_all(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"),
    }
}

/// A file of the folder itself: names with folders in them are none.
fn file(folder: &Path, path: &str) -> Option<PathBuf> {
    let name = if path.is_empty() { "index.html" } else { path };
    let is_plain = name.chars().all(|c| c.is_ascii_alphanumeric() || "._-".contains(c));
    (is_plain && !name.starts_with('.')).then(|| folder.join(name))
}

fn content_type(file: &Path) -> &'static str {
    match file.extension().and_then(|e| e.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("wasm") => "application/wasm",
        Some("json") => "application/json",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(server: &Server, text: &str) -> String {
        let mut stream = TcpStream::connect(("127.0.0.1", server.port)).expect("it listens");
        stream.write_all(text.as_bytes()).expect("sent");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("answered");
        answer
    }

    #[test]
    fn files_are_served_and_no_others() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("page")).expect("made");
        std::fs::write(folder.path().join("secret"), "s").expect("written");
        std::fs::write(folder.path().join("page/index.html"), "hello").expect("written");
        let server = Server::start(&folder.path().join("page"), 0).expect("a port");
        let page = request(&server, "GET /?scene=cornell HTTP/1.1\r\n\r\n");
        assert!(page.starts_with("HTTP/1.1 200") && page.ends_with("hello"), "{page}");
        assert!(page.contains("text/html"), "{page}");
        for path in ["/../secret", "/%2e%2e/secret", "/none.js"] {
            let answer = request(&server, &format!("GET {path} HTTP/1.1\r\n\r\n"));
            assert!(answer.starts_with("HTTP/1.1 404"), "{path}: {answer}");
        }
    }

    #[test]
    fn what_a_page_sends_is_received() {
        let folder = tempfile::tempdir().expect("a folder");
        let server = Server::start(folder.path(), 0).expect("a port");
        request(&server, "POST /sent/a HTTP/1.1\r\nContent-Length: 3\r\n\r\nabc");
        assert_eq!(server.receive("a", Duration::from_secs(5)).expect("sent"), b"abc");
        assert!(server.receive("b", Duration::from_millis(10)).is_err());
    }
}
