//! A USB device: its descriptors, its functions, and what the host asks of it on the control endpoint.

use crate::descriptor::{
    self, Class, DeviceDescriptor, Endpoint, FunctionDescriptors, IN, Speed, configuration, languages, string,
};
use crate::function::{ControlReply, FirstNumbers, Function};
use crate::identity::Identity;
use crate::setup::{Recipient, Refused, RequestKind, Setup, standard};

/// Self-powered: no; wakes the host: no; halted: no.
const STATUS: [u8; 2] = [0, 0];

/// A device of one or more functions. Requests for single endpoints are answered by the [`Peer`](crate::peer::Peer)'s.
pub(crate) struct Gadget {
    speed: Speed,
    device: DeviceDescriptor,
    configuration: Vec<u8>,
    strings: [String; 3],
    parts: Vec<FunctionSlot>,
    configured: u8,
}

struct FunctionSlot {
    place: FirstNumbers,
    group: FunctionDescriptors,
    function: Box<dyn Function>,
}

/// What became of a request.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Bytes of the answer, for the host.
    Data(Vec<u8>),
    /// Bytes for the device behind a function.
    Heard(usize, Vec<u8>),
    /// All endpoints are as new.
    Renewed,
}

impl Gadget {
    /// A device of these functions, which are numbered in their order.
    pub(crate) fn new(identity: Identity, speed: Speed, functions: Vec<Box<dyn Function>>) -> Self {
        let parts = placed(functions);
        let has_association = parts.iter().any(|part| part.group.interfaces.len() > 1);
        let device = DeviceDescriptor {
            class: if has_association { Class::BY_ASSOCIATION } else { Class::BY_INTERFACE },
            vendor: identity.vendor,
            product: identity.product,
            release: identity.release,
        };
        let groups: Vec<_> = parts.iter().map(|part| part.group.clone()).collect();
        let configuration = configuration(&groups);
        Self { speed, device, configuration, strings: identity.strings, parts, configured: 0 }
    }

    /// How fast it is.
    pub(crate) fn speed(&self) -> Speed {
        self.speed
    }

    /// A function.
    pub(crate) fn function(&mut self, number: usize) -> Option<&mut (dyn Function + 'static)> {
        self.parts.get_mut(number).map(|part| &mut *part.function)
    }

    /// All endpoints, each with the number of its function.
    pub(crate) fn endpoints(&self) -> impl Iterator<Item = (usize, Endpoint)> {
        self.parts.iter().enumerate().flat_map(|(number, part)| {
            let interfaces = part.group.interfaces.iter();
            interfaces.flat_map(|interface| &interface.endpoints).map(move |endpoint| (number, *endpoint))
        })
    }

    /// Address of the endpoint on which a function sends its data.
    pub(crate) fn data_address(&self, function: usize) -> Option<u8> {
        self.parts.get(function).map(|part| IN | part.place.endpoint)
    }

    /// A request that concerns no single endpoint; `data` are the host's.
    pub(crate) fn control(&mut self, setup: Setup, data: &[u8]) -> Result<Outcome, Refused> {
        match (setup.kind(), setup.recipient()) {
            (Some(RequestKind::Standard), Some(Recipient::Device)) => self.standard(setup),
            (Some(RequestKind::Standard), Some(Recipient::Interface)) => match setup.request {
                standard::GET_STATUS => Ok(Outcome::Data(STATUS.to_vec())),
                standard::GET_INTERFACE => Ok(Outcome::Data(vec![0])),
                standard::SET_INTERFACE if setup.value == 0 => Ok(Outcome::Renewed),
                _ => self.ask_interface(setup, data),
            },
            (Some(RequestKind::Class | RequestKind::Vendor), Some(Recipient::Interface)) => {
                self.ask_interface(setup, data)
            }
            (Some(RequestKind::Class | RequestKind::Vendor), Some(Recipient::Device)) => {
                self.ask_all(setup, data)
            }
            _ => Err(Refused),
        }
    }

    fn standard(&mut self, setup: Setup) -> Result<Outcome, Refused> {
        match setup.request {
            standard::GET_DESCRIPTOR => self.descriptor(setup).map(Outcome::Data),
            standard::GET_STATUS => Ok(Outcome::Data(STATUS.to_vec())),
            standard::GET_CONFIGURATION => Ok(Outcome::Data(vec![self.configured])),
            standard::SET_CONFIGURATION => {
                let [configured @ 0..=1, 0] = setup.value.to_le_bytes() else { return Err(Refused) };
                self.configured = configured;
                Ok(Outcome::Renewed)
            }
            _ => Err(Refused),
        }
    }

    fn descriptor(&self, setup: Setup) -> Result<Vec<u8>, Refused> {
        match setup.descriptor() {
            (descriptor::kind::DEVICE, 0) => Ok(self.device.encode()),
            (descriptor::kind::CONFIGURATION, 0) => Ok(self.configuration.clone()),
            (descriptor::kind::STRING, 0) => Ok(languages()),
            (descriptor::kind::STRING, number) => {
                let text = self.strings.get(usize::from(number) - 1);
                text.map(|text| string(text)).ok_or(Refused)
            }
            _ => Err(Refused),
        }
    }

    fn ask_interface(&mut self, setup: Setup, data: &[u8]) -> Result<Outcome, Refused> {
        let asked = setup.index_low();
        let has_it =
            |part: &FunctionSlot| part.group.interfaces.iter().any(|interface| interface.number == asked);
        let number = self.parts.iter().position(has_it).ok_or(Refused)?;
        self.ask(number, setup, data)
    }

    /// The first function that knows the request takes it.
    fn ask_all(&mut self, setup: Setup, data: &[u8]) -> Result<Outcome, Refused> {
        (0..self.parts.len()).find_map(|number| self.ask(number, setup, data).ok()).ok_or(Refused)
    }

    fn ask(&mut self, number: usize, setup: Setup, data: &[u8]) -> Result<Outcome, Refused> {
        let function = self.function(number).ok_or(Refused)?;
        Ok(match function.control(setup, data)? {
            ControlReply::Data(data) => Outcome::Data(data),
            ControlReply::Heard(bytes) => Outcome::Heard(number, bytes),
        })
    }
}

/// Gives each function its numbers, none twice.
fn placed(functions: Vec<Box<dyn Function>>) -> Vec<FunctionSlot> {
    let mut place = FirstNumbers { interface: 0, endpoint: 1 };
    let mut parts = Vec::new();
    for function in functions {
        let group = function.group(place);
        parts.push(FunctionSlot { place, group: group.clone(), function });
        let endpoints = group.interfaces.iter().flat_map(|interface| &interface.endpoints);
        let last = endpoints.map(|endpoint| endpoint.address & !IN).max();
        place.endpoint = last.map_or(place.endpoint, |last| last + 1);
        place.interface = group.interfaces.last().map_or(place.interface, |last| last.number + 1);
    }
    parts
}

#[cfg(test)]
#[path = "gadget_tests.rs"]
mod tests;
