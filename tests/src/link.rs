//! A network link between two programs of this machine, which can be cut.

use std::io;
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

/// A link to an endpoint of the bus. Whoever connects to [`Link::endpoint`] reaches it while the link is not cut.
#[derive(Debug)]
pub struct Link {
    /// Its near end.
    pub endpoint: String,
    state: Arc<Mutex<State>>,
}

#[derive(Debug, Default)]
struct State {
    is_cut: bool,
    open: Vec<TcpStream>,
}

impl Link {
    /// A link to `tcp/HOST:PORT`.
    ///
    /// # Errors
    /// The system's.
    pub fn to(endpoint: &str) -> io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let address = endpoint.trim_start_matches("tcp/").to_owned();
        let near = format!("tcp/{}", listener.local_addr()?);
        let state = Arc::new(Mutex::new(State::default()));
        let of_thread = Arc::clone(&state);
        // It ends with the tests' process.
        thread::Builder::new().name("link".into()).spawn(move || {
            for connection in listener.incoming().map_while(Result::ok) {
                // Whoever connected sees a connection that ends.
                drop(join(connection, &address, &of_thread));
            }
        })?;
        Ok(Self { endpoint: near, state })
    }

    /// Ends all connections, and each new one.
    pub fn cut(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.is_cut = true;
        for connection in state.open.drain(..) {
            // It may have ended already.
            drop(connection.shutdown(Shutdown::Both));
        }
    }

    /// Takes connections again.
    pub fn restore(&self) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).is_cut = false;
    }
}

fn join(near: TcpStream, address: &str, state: &Mutex<State>) -> io::Result<()> {
    let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
    if state.is_cut {
        return Ok(());
    }
    let far = TcpStream::connect(address)?;
    for (from, to) in [(&near, &far), (&far, &near)] {
        let (mut from, mut to) = (from.try_clone()?, to.try_clone()?);
        thread::Builder::new().name("link".into()).spawn(move || {
            // A cut ends it, too.
            drop(io::copy(&mut from, &mut to));
            drop(to.shutdown(Shutdown::Both));
        })?;
    }
    state.open.extend([near, far]);
    Ok(())
}
