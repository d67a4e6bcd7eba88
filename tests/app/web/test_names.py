"""Names for --allow-host: what is one, how a browser writes it, and what a mistake is told."""

import pytest

from app.web.names import allowed_names, host_name
from packetmesh.errors import InputError


@pytest.mark.parametrize(
    ("given", "sent"),
    [
        ("lab.example.org", "lab.example.org"),
        ("LAB.Example.org", "lab.example.org"),
        ("lab.example.org.", "lab.example.org"),
        ("büro.example.org", "xn--bro-hoa.example.org"),
        ("container_1", "container_1"),
        ("192.168.1.5", "192.168.1.5"),
        ("[2001:DB8::1]", "2001:db8::1"),
        ("localhost", "localhost"),
    ],
)
def test_a_name_is_as_browsers_send_it(given, sent):
    assert allowed_names([given]) == {sent}
    assert host_name(f"[{sent}]:9002" if ":" in sent else f"{sent}:9002") == sent


@pytest.mark.parametrize(
    ("given", "hint"),
    [
        ("http://lab.example.org:9002/pm/", "try --allow-host lab.example.org"),
        ("lab.example.org:9002", "try --allow-host lab.example.org"),
        ("lab.example.org/pm", "try --allow-host lab.example.org"),
        ("*", "without protocol"),
        ("*.example.org", "without protocol"),
        ("8080", "without protocol"),
        ("127.1", "without protocol"),
        ("lab.0x7f", "without protocol"),
        ("", "without protocol"),
        (".", "without protocol"),
        ("a b", "without protocol"),
        ("lab..example.org", "without protocol"),
        ("-lab", "without protocol"),
        ("lab;rm", "without protocol"),
        ("<b>", "without protocol"),
        ("[::1", "without protocol"),
        ("a" * 64, "without protocol"),
        (".".join(["a" * 50] * 6), "without protocol"),
    ],
)
def test_what_is_no_name_is_one_sentence_with_a_name_to_try(given, hint):
    with pytest.raises(InputError) as error:
        allowed_names(["good.example", given])
    assert str(error.value).startswith(f"--allow-host has '{given}', which is not a host name; try ")
    assert hint in str(error.value)
