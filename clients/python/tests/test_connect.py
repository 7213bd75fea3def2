import socket
import threading

import pytest

import tactus_client


def test_an_absent_service_is_reported_at_once(free_endpoint):
    with pytest.raises(tactus_client.NoService, match=f"no service at {free_endpoint}"):
        tactus_client.connect(free_endpoint)


def test_another_program_is_not_taken_for_a_service():
    with socket.create_server(("127.0.0.1", 0)) as server:

        def hang_up():
            # Once for the plain connection and once for zenoh's.
            for _ in range(2):
                server.accept()[0].close()

        threading.Thread(target=hang_up).start()
        with pytest.raises(tactus_client.NoService, match="does not answer as a Tactus service"):
            tactus_client.connect(f"tcp/127.0.0.1:{server.getsockname()[1]}")


@pytest.mark.parametrize("endpoint", ["", "127.0.0.1:7447", "tcp/127.0.0.1", "tcp/:1", "tcp/a:b", "tcp/a:1#iface=lo"])
def test_an_invalid_endpoint_is_refused(endpoint):
    with pytest.raises(ValueError, match="tcp/HOST:PORT"):
        tactus_client.connect(endpoint)


@pytest.mark.parametrize("rig", ["*", "**", "a/b", "", "a b"])
def test_a_rig_name_with_a_wildcard_is_refused(rig, free_endpoint):
    with pytest.raises(ValueError, match="rig name"):
        tactus_client.connect(free_endpoint, rig)
