"""Real recordings with part of their physics concealed: what the tool says of them, and what is known of them.

A recording is a folder here with four files; adding one is adding a folder:

==================  ==================================================================================================
``case.toml``       what is concealed, which channels the tool may see, which recordings are fitted and which held out
``model.toml``      the nominal model, with the concealed physics left out
``truth.toml``      what is known of the machine; read when the tool has answered
``provenance.md``   source, licence, citation
==================  ==================================================================================================

The recordings themselves are no part of the project.
"""
