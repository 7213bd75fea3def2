//! Requests of the host on the control endpoint.
//!
//! # Source
//! USB 2.0, section 9.3 (the setup data), table 9-4 (standard requests), table 9-5 (descriptor types).

/// Length of the setup data.
pub(crate) const SETUP_BYTES: usize = 8;

/// Standard requests, table 9-4.
pub(crate) mod standard {
    pub(crate) const GET_STATUS: u8 = 0;
    pub(crate) const CLEAR_FEATURE: u8 = 1;
    pub(crate) const SET_FEATURE: u8 = 3;
    pub(crate) const GET_DESCRIPTOR: u8 = 6;
    pub(crate) const GET_CONFIGURATION: u8 = 8;
    pub(crate) const SET_CONFIGURATION: u8 = 9;
    pub(crate) const GET_INTERFACE: u8 = 10;
    pub(crate) const SET_INTERFACE: u8 = 11;
}

/// The feature of an endpoint that has halted, table 9-6.
pub(crate) const ENDPOINT_HALT: u16 = 0;

/// The setup data of a control transfer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Setup {
    request_type: u8,
    pub(crate) request: u8,
    pub(crate) value: u16,
    pub(crate) index: u16,
    pub(crate) length: u16,
}

/// Who defines a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RequestKind {
    Standard,
    Class,
    Vendor,
}

/// The recipient of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Recipient {
    Device,
    Interface,
    Endpoint,
}

/// The device refuses the request: the control endpoint stalls until the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Refused;

impl Setup {
    /// Reads the setup data.
    pub(crate) fn parse(bytes: [u8; SETUP_BYTES]) -> Self {
        let [request_type, request, value_low, value_high, index_low, index_high, length_low, length_high] =
            bytes;
        Self {
            request_type,
            request,
            value: u16::from_le_bytes([value_low, value_high]),
            index: u16::from_le_bytes([index_low, index_high]),
            length: u16::from_le_bytes([length_low, length_high]),
        }
    }

    /// True if the device is to answer with data.
    pub(crate) fn is_in(self) -> bool {
        self.request_type & 0x80 != 0
    }

    /// Who defines the request; `None` for reserved values.
    pub(crate) fn kind(self) -> Option<RequestKind> {
        match self.request_type >> 5 & 0b11 {
            0 => Some(RequestKind::Standard),
            1 => Some(RequestKind::Class),
            2 => Some(RequestKind::Vendor),
            _ => None,
        }
    }

    /// Its recipient; `None` for reserved values.
    pub(crate) fn recipient(self) -> Option<Recipient> {
        match self.request_type & 0b1_1111 {
            0 => Some(Recipient::Device),
            1 => Some(Recipient::Interface),
            2 => Some(Recipient::Endpoint),
            _ => None,
        }
    }

    /// The lower byte of the index: the number of an interface, the address of an endpoint.
    pub(crate) fn index_low(self) -> u8 {
        self.index.to_le_bytes()[0]
    }

    /// Type and number of the descriptor, in a request for one.
    pub(crate) fn descriptor(self) -> (u8, u8) {
        let [number, kind] = self.value.to_le_bytes();
        (kind, number)
    }
}
