//! `--tev HOST:PORT`: shows a picture in the viewer tev while it is made.
//!
//! tev listens on a TCP port for packets that create an image and replace a part of its pixels. The
//! pixels are linear exposure values, as in an EXR file. tev sends nothing back.

use std::io::{Error, ErrorKind, Result as IoResult};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use ivcam_base::diag::{self, Diagnostic, Result};
use ivcam_optics::film::{Region, Resolution};
use ivcam_optics::picture::{Picture, ROWS};
use ivcam_render::render::{Alarm, Keeper, StateView};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

use super::print_diagnostic;

/// The least time between two states of the picture.
const INTERVAL: Duration = Duration::from_millis(500);
/// The time to the next state as a multiple of the time that the last one took, so that sending
/// takes at most a tenth of a thread's time.
const PAUSE: u32 = 9;
/// How long tev may take to answer a connection or to accept bytes. A viewer that hangs must not
/// hold up the render for longer.
const LONGEST_WAIT: Duration = Duration::from_secs(10);
/// The names of the channels.
const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// An image in a running tev.
pub(crate) struct TevView {
    /// The name of the image.
    name: String,
    /// The connection; `None` after it has broken.
    client: Mutex<Option<TevClient>>,
    alarm: Alarm,
}

impl TevView {
    /// Connects to the tev that listens on an address, for an image with a name.
    ///
    /// # Errors
    /// Returns an error if there is no connection.
    pub(super) fn connect(address: &str, name: String) -> Result<Self> {
        let stream = connection(address).map_err(|error| {
            let text = format!("`--tev {address}`: there is no connection to tev: {error}");
            let help = "start tev first, and name its HOST:PORT, which is 127.0.0.1:14158 unless \
                        its `--hostname` says otherwise";
            Diagnostic::error(text)
                .of_kind(diag::ErrorKind::Io)
                .with_help(help)
        })?;
        Ok(Self {
            name,
            client: Mutex::new(Some(TevClient::wrap(stream))),
            alarm: Alarm::new(Some(INTERVAL)),
        })
    }

    /// Shows a black image of a size.
    pub(super) fn begin(&self, size: Resolution) {
        self.send(|client| {
            client.send(PacketCreateImage {
                image_name: &self.name,
                grab_focus: true,
                width: size.width,
                height: size.height,
                channel_names: &CHANNELS,
            })
        });
    }

    /// Shows the finished picture.
    pub(super) fn show(&self, picture: &Picture) {
        let rows = picture
            .pixels
            .chunks((ROWS * picture.width) as usize)
            .zip((0..).step_by(ROWS as usize));
        self.send(|client| {
            for (levels, top) in rows {
                let rows = Region::new([0, top], [picture.width, ROWS.min(picture.height - top)]);
                self.replace(client, rows, levels)?;
            }
            Ok(())
        });
    }

    /// Sends packets, unless the connection has broken. Warns if it breaks.
    fn send(&self, packets: impl FnOnce(&mut TevClient) -> IoResult<()>) {
        let mut client = self.client.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(Err(error)) = client.as_mut().map(packets) else {
            return;
        };
        *client = None;
        let reason = match error.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => {
                format!("it accepts nothing for {} s", LONGEST_WAIT.as_secs())
            }
            _ => error.to_string(),
        };
        let text = format!("the connection to tev has broken: {reason}");
        print_diagnostic(&Diagnostic::warning(text).with_help("the render goes on without it"));
    }

    /// Replaces the pixels in a part of the image.
    fn replace(&self, client: &mut TevClient, part: Region, levels: &[[f32; 3]]) -> IoResult<()> {
        client.send(PacketUpdateImage {
            image_name: &self.name,
            grab_focus: false,
            channel_names: &CHANNELS,
            channel_offsets: &[0, 1, 2],
            channel_strides: &[3; 3],
            x: part.left,
            y: part.top,
            width: part.width,
            height: part.height,
            data: levels.as_flattened(),
        })
    }
}

impl Keeper for TevView {
    fn is_stopped(&self) -> bool {
        false
    }

    fn is_due(&self) -> bool {
        self.alarm.is_due()
    }

    fn keep(&self, state: &StateView<'_, '_>) {
        let start = Instant::now();
        self.send(|client| state.for_each_row(|rows, levels| self.replace(client, rows, levels)));
        self.alarm.set(INTERVAL.max(PAUSE * start.elapsed()));
    }
}

/// Connects to the first of a name's addresses that answers.
fn connection(address: &str) -> IoResult<TcpStream> {
    let mut error = Error::new(ErrorKind::InvalidInput, "the name has no address");
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, LONGEST_WAIT) {
            Ok(stream) => {
                stream.set_write_timeout(Some(LONGEST_WAIT))?;
                return Ok(stream);
            }
            Err(refused) => error = refused,
        }
    }
    Err(error)
}
