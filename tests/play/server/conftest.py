"""Tests that are coroutines run on an event loop of their own."""

import pytest


@pytest.fixture
def anyio_backend():
    return "asyncio"
