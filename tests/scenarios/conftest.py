"""What all whole drives share."""

from tests.teleop.scenario.conftest import derived_files as derived_files
