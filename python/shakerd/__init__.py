"""Python beside shakerd: follow a rig, run a campaign, read what was recorded, estimate and diagnose.

    import shakerd

    with shakerd.connect() as rig:                      # the daemon's socket
        for document in rig.run("campaign.json"):       # in control as long as this loop goes on
            if document["type"] == "estimate":
                print(document["parameters"])

    campaign = shakerd.open_campaign("campaign.db")     # an SQLite file of the daemon
    t, stroke = campaign.samples("slow", "displacement")
    print(shakerd.diagnose("campaign.db")["effects"])   # by shakerctl

The standard library is enough. Where NumPy is installed, samples and cycles are NumPy arrays, else
`array.array`. All numbers are SI: m, m/s^2, N, s, Hz.
"""
from .campaign import Campaign, Cycle, Fact, NotACampaign, Run, open_campaign
from .client import Client, ConnectionLost, Refused, connect
from .folder import CampaignFolder, Recording, open_folder
from .tools import ToolFailed, diagnose, estimate, import_campaign

__all__ = ["Campaign", "CampaignFolder", "Client", "ConnectionLost", "Cycle", "Fact", "NotACampaign", "Recording",
           "Refused", "Run", "ToolFailed", "connect", "diagnose", "estimate", "import_campaign", "open_campaign",
           "open_folder"]
__version__ = "0.2.0"
