"""Worlds and their maps: generated buildings, survey drives, scene folders and figures of scenes."""
