MODULE Arguments
  PROC p(\switch on|switch off,num a\num b,\PERS tooldata t\INOUT num c{*})
    MoveL p1,\ID:=10,v100,z10,tGun,\WObj:=wPart;
    MoveL p1\ID:=10,v100\V:=5\T:=2,z10\Inpos:=inpos50,tGun\WObj:=wPart\TLoad:=l1;
    Grip\Open\Fast;
    Search\Stop,di1\Flanks,p1,p2\ID?id,v10,tGun\WObj?w;
    Named speed:=v10,zone:=fine\x:=1;
    x:=Pick(1\Far,2\Near?on);
    y:=Clock();
    z:=Read(\Bin\Time:=3);
  ENDPROC
ENDMODULE
