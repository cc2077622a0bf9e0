//! A viewer with tev's protocol, which a test asks for what it shows.

use std::io::{ErrorKind, Read};
use std::net::{TcpListener, TcpStream};
use std::thread::JoinHandle;

/// A viewer that waits for one connection.
pub struct Viewer {
    pub address: String,
    thread: JoinHandle<Shown>,
}

/// What a viewer has received.
#[derive(Default)]
pub struct Shown {
    pub name: String,
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<[f32; 3]>,
    /// How often the first pixel was replaced.
    pub states: u32,
}

impl Viewer {
    /// Starts a viewer, which is gone after a number of packets.
    pub fn start(packets: usize) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        Self {
            address: listener.local_addr().unwrap().to_string(),
            thread: std::thread::spawn(move || {
                let (mut stream, _) = listener.accept().unwrap();
                let mut shown = Shown::default();
                for _ in 0..packets {
                    match packet(&mut stream) {
                        Some(bytes) => shown.obey(&bytes),
                        None => break,
                    }
                }
                shown
            }),
        }
    }

    /// Returns what it has received when the connection ends.
    pub fn shown(self) -> Shown {
        self.thread.join().unwrap()
    }
}

impl Shown {
    /// Returns the values of each channel with its name.
    pub fn channels(&self) -> [(Vec<f32>, &'static str); 3] {
        let channel = |c: usize| self.pixels.iter().map(|p| p[c]).collect();
        [(channel(0), "R"), (channel(1), "G"), (channel(2), "B")]
    }

    /// Carries out a packet.
    fn obey(&mut self, mut packet: &[u8]) {
        let kind = number::<1>(&mut packet)[0];
        number::<1>(&mut packet); // whether the image is selected
        let name = word(&mut packet);
        match kind {
            4 => {
                let [width, height] = [int(&mut packet), int(&mut packet)];
                assert_eq!(names(&mut packet), ["R", "G", "B"]);
                let pixels = vec![[0.0; 3]; (width * height) as usize];
                *self = Self {
                    name,
                    width,
                    height,
                    pixels,
                    states: 0,
                };
            }
            6 => {
                assert_eq!(name, self.name);
                assert_eq!(names(&mut packet), ["R", "G", "B"]);
                let [x, y, width, height] = [(); 4].map(|_| int(&mut packet));
                assert!(x + width <= self.width && y + height <= self.height);
                let [offsets, strides] =
                    [(); 2].map(|_| [(); 3].map(|_| u64::from_le_bytes(number(&mut packet))));
                let (values, rest) = packet.as_chunks::<4>();
                assert!(rest.is_empty());
                for i in 0..width * height {
                    let channel = |c: usize| {
                        let at = offsets[c] + strides[c] * u64::from(i);
                        f32::from_le_bytes(values[at as usize])
                    };
                    let at = (y + i / width) * self.width + x + i % width;
                    self.pixels[at as usize] = [0, 1, 2].map(channel);
                }
                self.states += u32::from((x, y) == (0, 0));
            }
            _ => panic!("a packet of kind {kind}"),
        }
    }
}

/// Returns the next packet without its length, or `None` at the end.
fn packet(stream: &mut TcpStream) -> Option<Vec<u8>> {
    let mut length = [0; 4];
    match stream.read_exact(&mut length) {
        Err(e) if e.kind() == ErrorKind::UnexpectedEof => return None,
        result => result.unwrap(),
    }
    let mut bytes = vec![0; u32::from_le_bytes(length) as usize - 4];
    stream.read_exact(&mut bytes).unwrap();
    Some(bytes)
}

fn number<const N: usize>(bytes: &mut &[u8]) -> [u8; N] {
    let (first, rest) = bytes.split_first_chunk().unwrap();
    *bytes = rest;
    *first
}

fn int(bytes: &mut &[u8]) -> u32 {
    u32::from_le_bytes(number(bytes))
}

fn word(bytes: &mut &[u8]) -> String {
    let end = bytes.iter().position(|b| *b == 0).unwrap();
    let word = String::from_utf8(bytes[..end].to_vec()).unwrap();
    *bytes = &bytes[end + 1..];
    word
}

fn names(bytes: &mut &[u8]) -> Vec<String> {
    (0..int(bytes)).map(|_| word(bytes)).collect()
}
