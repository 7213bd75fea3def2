use super::Endpoint;

#[test]
fn well_formed_endpoints_keep_their_text() {
    for text in [
        "tcp/127.0.0.1:7447",
        "tcp/[::1]:7447",
        "tcp/lab-3.example.org:1",
        "tcp/0.0.0.0:65535",
        "tls/lab-3:7447",
        "unixsock-stream//run/tactus/bus.sock",
    ] {
        assert_eq!(text.parse::<Endpoint>().unwrap().to_string(), text);
    }
    assert_eq!(Endpoint::default().to_string(), "tcp/127.0.0.1:7447");
}

#[test]
fn malformed_endpoints_are_refused_with_the_reason() {
    for (text, reason) in [
        ("", "tcp/"),
        ("127.0.0.1:7447", "tcp/"),
        ("udp/127.0.0.1:7447", "tcp/"),
        ("tcp/127.0.0.1", "port is missing"),
        ("tcp/127.0.0.1:", "1 to 65535"),
        ("tcp/127.0.0.1:0", "1 to 65535"),
        ("tcp/127.0.0.1:65536", "1 to 65535"),
        ("tcp/:7447", "host"),
        ("tcp/::1:7447", "host"),
        ("tcp/a b:7447", "host"),
        ("tcp/127.0.0.1?rel=0:7447", "host"),
        ("tcp/127.0.0.1:7447#iface=eth0", "1 to 65535"),
        ("unixsock-stream/bus.sock", "begins with /"),
        ("unixsock-stream//run/a?b", "letters"),
    ] {
        let error = text.parse::<Endpoint>().unwrap_err().to_string();
        assert!(error.contains(reason) && error.contains(&format!("{text:?}")), "{text}: {error}");
    }
}

#[test]
fn loopback_is_told_from_the_world() {
    for (text, loopback) in [
        ("tcp/127.0.0.1:7447", true),
        ("tcp/127.9.9.9:7447", true),
        ("tcp/[::1]:7447", true),
        ("tcp/localhost:7447", true),
        ("tls/127.0.0.1:7447", true),
        ("unixsock-stream//run/tactus/bus.sock", true),
        ("tls/0.0.0.0:7447", false),
        ("tcp/0.0.0.0:7447", false),
        ("tcp/[::]:7447", false),
        ("tcp/192.168.1.4:7447", false),
        ("tcp/localhost.example.org:7447", false),
    ] {
        assert_eq!(text.parse::<Endpoint>().unwrap().is_loopback(), loopback, "{text}");
    }
}
